from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import ObjectOverride
from r2c2r_core.synthesize import layout as layout_module
from r2c2r_core.synthesize.dimensions import MeasuredObject, measure_object
from r2c2r_core.synthesize.layout import Layout, arrange, overlapping_pairs, with_outliers
from r2c2r_core.synthesize.layout import Params as LayoutParams
from r2c2r_core.tuning import tuned
from tests.core.motions import motion
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit

NOTHING = ObjectOverride()


def arranged(*units: Unit, overrides: dict[str, ObjectOverride] | None = None, manhattan: float = 0.3) -> Layout:
    items = [placed(unit, (overrides or {}).get(unit.name, ObjectOverride())) for unit in units]
    return arrange(items, manhattan, floor_found=True)


def placed(unit: Unit, override: ObjectOverride = NOTHING) -> MeasuredObject:
    return measure_object(capture(), *placed_unit(unit, np.random.default_rng(0)), category_of(unit.category), override)


def run_of_doors(noise_m: float, yaw_noise_rad: float) -> list[Unit]:
    rng = np.random.default_rng(3)
    return [
        Unit(
            f"d{i}",
            "cabinet",
            (0.503 * i, float(rng.normal() * noise_m), 0.5),
            (0.5, 0.58, 0.7),
            yaw=float(rng.normal() * yaw_noise_rad),
            handle=Handle(0.2, 0.1),
        )
        for i in range(5)
    ]


def test_a_run_becomes_coplanar_and_parallel() -> None:
    layout = arranged(*run_of_doors(0.004, 0.01))
    fronts = np.array([o.front_centre @ o.outward for o in layout.objects])
    yaws = np.array([np.arctan2(o.outward[1], o.outward[0]) for o in layout.objects])
    assert np.ptp(fronts) < 1e-6
    assert np.ptp(yaws) < 1e-9
    assert abs(yaws[0] + np.pi / 2) < np.deg2rad(0.35)  # five fronts over 2 m, 4 mm of noise each
    assert max(layout.moves_m.values()) < 0.015


def test_the_report_counts_what_the_alignment_moved() -> None:
    units = run_of_doors(0.0, 0.0)
    back = replace(units[2], centre=(units[2].centre[0], 0.01, units[2].centre[2]))
    layout = arranged(*units[:2], back, *units[3:], manhattan=0.0)
    assert layout.moves_m["d2"] == pytest.approx(0.01, abs=2e-3)


def test_runs_that_cannot_be_levelled_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(layout_module, "level_runs", fails)
    layout = arranged(*run_of_doors(0.0, 0.0), manhattan=0.0)
    assert len(layout.objects) == 5
    assert any("were not levelled" in warning for warning in layout.warnings)


def test_a_run_almost_parallel_to_the_room_is_aligned_with_it() -> None:
    layout = arranged(*run_of_doors(0.002, 0.004), manhattan=0.0)
    np.testing.assert_allclose([o.outward for o in layout.objects], [[0, -1, 0]] * 5, atol=1e-9)


def test_a_free_standing_appliance_keeps_its_yaw_unless_nearly_aligned() -> None:
    """About a degree of difference to the run is intended; half a degree is within the measurement error of its front."""
    for turned_deg, expected_deg in ((4.0, 4.0), (0.9, 0.9), (0.5, 0.0)):
        yaw = float(np.deg2rad(turned_deg))
        units = [
            *run_of_doors(0.0, 0.0),
            Unit("m", "microwave", (1.0, 0.05, 1.08), (0.5, 0.36, 0.28), yaw=yaw, kind="appliance"),
        ]
        microwave = arranged(*units, manhattan=0.0).objects[-1]
        found = np.arctan2(microwave.outward[0], -microwave.outward[1])
        assert abs(np.rad2deg(found) - expected_deg) < 0.05, turned_deg


def test_a_front_that_protrudes_5_cm_stays_protruding() -> None:
    units = [*run_of_doors(0.0, 0.0), Unit("tall", "cabinet", (2.52, -0.05, 0.5), (0.5, 0.58, 0.7))]
    layout = arranged(*units)
    assert abs(layout.objects[-1].front_centre[1] - (-0.34)) < 1e-3


def test_small_overlaps_are_trimmed_and_leave_a_gap() -> None:
    layout = arranged(
        Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7)), Unit("b", "cabinet", (0.494, 0, 0.5), (0.5, 0.58, 0.7))
    )
    a, b = layout.objects
    gap = (b.front_centre[0] - b.dimensions_m[0] / 2) - (a.front_centre[0] + a.dimensions_m[0] / 2)
    assert tuned(LayoutParams).gap_m <= gap < 0.0031
    assert abs(a.dimensions_m[0] - 0.5) < 0.006
    assert max(layout.moves_m.values()) < 0.005


def test_large_overlaps_are_separated_and_the_moves_are_reported() -> None:
    layout = arranged(
        Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7)), Unit("b", "cabinet", (0.44, 0, 0.5), (0.5, 0.58, 0.7))
    )
    assert overlapping_pairs(layout.objects) == []
    assert 0.02 < layout.moves_m["a"] < 0.04
    assert 0.02 < layout.moves_m["b"] < 0.04


def test_an_unusually_large_move_gives_a_warning() -> None:
    layout = arranged(
        Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7)), Unit("b", "refrigerator", (0.5, 0, 0.9), (0.65, 0.62, 1.8))
    )
    assert overlapping_pairs(layout.objects) == []
    assert ["b was moved by" in warning for warning in layout.warnings] == [True]


def test_an_implausible_object_is_an_outlier_and_moves_nothing() -> None:
    """A front that includes several units of the run overlaps two cabinets and a refrigerator that are correct."""
    right = [
        Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7)),
        Unit("b", "cabinet", (0.503, 0, 0.5), (0.5, 0.58, 0.7)),
        Unit("cold", "refrigerator", (1.1, 0, 0.9), (0.65, 0.62, 1.8)),
    ]
    wrong = Unit("wide", "cabinet", (0.6, 0, 0.5), (1.2, 0.58, 0.7))
    layout = arranged(*right, wrong, manhattan=0.0)
    assert [item.name for item in layout.objects] == ["a", "b", "cold"]
    assert max(layout.moves_m.values()) < 0.005
    assert list(layout.outliers) == ["wide"]
    assert "overlaps a by" in layout.outliers["wide"]
    assert with_outliers(layout, [placed(wrong)]).objects[-1].name == "wide"


def test_of_two_overlapping_fronts_the_one_filmed_while_it_opened_is_kept() -> None:
    pair = placed(Unit("pair", "cabinet", (0.0, 0, 0.5), (0.9, 0.58, 0.7)))
    wide = placed(Unit("wide", "cabinet", (0.6, 0, 0.5), (0.6, 0.58, 0.7)))
    likelier = arrange([replace(pair, confidence=0.5), replace(wide, confidence=0.9)], 0.0, floor_found=True)
    assert list(likelier.outliers) == ["pair"]
    seen = replace(pair, confidence=0.5, motions=(motion({5: 1.0}, "left", world_from_front=pair.world_from_object),))
    assert list(arrange([seen, replace(wide, confidence=0.9)], 0.0, floor_found=True).outliers) == ["wide"]


def test_an_object_placed_by_a_person_is_not_an_outlier() -> None:
    pose = np.eye(4)
    pose[:3, 3] = (0.0, 0.0, 0.5)
    units = [
        Unit("a", "cabinet", (0.0, 0, 0.5), (0.5, 0.58, 0.7)),
        Unit("b", "cabinet", (0.2, 0, 0.5), (0.5, 0.58, 0.7)),
    ]
    assert list(arranged(*units, overrides={"a": ObjectOverride(pose=pose)}).outliers) == ["b"]


def test_an_object_placed_by_a_person_is_fixed_and_its_neighbour_moves() -> None:
    pose = np.eye(4)
    pose[:3, 3] = (0.0, 0.0, 0.5)
    layout = arranged(
        Unit("a", "cabinet", (0.01, 0, 0.5), (0.5, 0.58, 0.7)),
        Unit("b", "cabinet", (0.44, 0, 0.5), (0.5, 0.58, 0.7)),
        overrides={"a": ObjectOverride(pose=pose)},
    )
    np.testing.assert_allclose(layout.objects[0].world_from_object.translation, [0, 0, 0.5], atol=1e-9)
    assert overlapping_pairs(layout.objects) == []


def test_an_inferred_depth_is_shortened_before_a_measured_front_moves() -> None:
    """Two runs meet in a corner: one cabinet's inferred depth runs into the other run."""
    layout = arranged(
        Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.7, 0.7)),
        Unit("b", "cabinet", (0.0, 0.59, 0.5), (0.6, 0.5, 0.7), yaw=np.pi / 2),
        manhattan=0.0,
    )
    assert overlapping_pairs(layout.objects) == []
    assert max(layout.moves_m.values()) < 1e-4  # of the fronts


def test_things_are_placed_on_the_support_below_them() -> None:
    layout_params = tuned(LayoutParams)
    layout = arranged(
        Unit("top", "counter", (0, 0, 0.9), (1.2, 0.62, 0.04), kind="thing"),
        Unit("bottle", "bottle", (0.1, 0, 1.052), (0.08, 0.08, 0.24), kind="thing"),
        Unit("sunk", "mug", (-0.3, 0, 0.963), (0.09, 0.09, 0.1), kind="thing"),
    )
    counter, *things = layout.objects
    top = counter.world_from_object.translation[2] + counter.dimensions_m[2] / 2
    for thing in things:
        bottom = thing.world_from_object.translation[2] - thing.dimensions_m[2] / 2
        assert abs(bottom - top - layout_params.rest_gap_m) < 1e-6
    assert overlapping_pairs(layout.objects) == []


@pytest.mark.parametrize("below_m", [0.004, 0.045])
def test_objects_below_the_floor_are_raised_onto_it(below_m: float) -> None:
    (chair,) = arranged(Unit("chair", "chair", (0, 0, 0.41 - below_m), (0.45, 0.55, 0.82), kind="thing")).objects
    underside_m = chair.world_from_object.translation[2] - chair.dimensions_m[2] / 2
    assert 0.0 < underside_m < 0.001


def test_a_wall_cabinet_stays_at_its_measured_height() -> None:
    layout = arranged(Unit("w", "wall_cabinet", (0, 0, 1.71), (0.6, 0.35, 0.7)), manhattan=0.0)
    assert layout.moves_m["w"] < 1e-6


def test_noisy_edges_of_a_run_snap_to_shared_lines_and_seams() -> None:
    """With 3 mm of noise per edge, tops and bottoms become level, gaps 3 mm, and widths no less accurate than measured."""
    rng = np.random.default_rng(5)
    noisy = []
    for i in range(5):
        left, right, low, high = np.array([0.503 * i - 0.25, 0.503 * i + 0.25, 0.15, 0.85]) + rng.normal(size=4) * 0.003
        noisy.append(Unit(f"d{i}", "cabinet", ((left + right) / 2, 0, (low + high) / 2), (right - left, 0.58, high - low)))
    layout = arranged(*noisy, manhattan=0.0)
    centres = np.array([o.world_from_object.translation for o in layout.objects])
    sizes = np.array([o.dimensions_m for o in layout.objects])
    assert np.ptp(centres[:, 2] + sizes[:, 2] / 2) < 1e-9
    assert np.ptp(centres[:, 2] - sizes[:, 2] / 2) < 1e-9
    gaps = (centres[1:, 0] - sizes[1:, 0] / 2) - (centres[:-1, 0] + sizes[:-1, 0] / 2)
    np.testing.assert_allclose(gaps, 0.003, atol=1e-6)
    measured_error = np.abs([u.size[0] - 0.5 for u in noisy]).mean()
    assert np.abs(sizes[:, 0] - 0.5).mean() <= measured_error


def test_a_run_that_sags_along_its_length_is_levelled() -> None:
    """A degree of roll makes each unit 9 mm lower than the one before, 27 mm in all."""
    units = [Unit(f"d{i}", "cabinet", (0.503 * i, 0, 0.5 - 0.009 * i), (0.5, 0.58, 0.7)) for i in range(4)]
    layout = arranged(*units, manhattan=0.0)
    assert np.ptp([o.world_from_object.translation[2] for o in layout.objects]) < 1e-6
    assert max(layout.moves_m.values()) < 0.015
    np.testing.assert_allclose([o.dimensions_m[2] for o in layout.objects], 0.7, atol=1e-3)


def test_two_runs_of_a_tilted_room_get_level_lines_of_one_height() -> None:
    """Up is off by 2°: the tops of an L fall by 13 cm, beyond any tolerance of a tie."""
    tilt = np.array([0.022, 0.026])
    back = [Unit(f"b{i}", "cabinet", (0.503 * i, 0.0, 0.5), (0.5, 0.58, 0.7)) for i in range(5)]
    left = [Unit(f"l{i}", "cabinet", (-0.6, -0.6 - 0.503 * i, 0.5), (0.5, 0.58, 0.7), yaw=np.pi / 2) for i in range(4)]
    items = []
    for unit in [*back, *left]:
        item = placed(unit)
        fallen = item.world_from_object.translation - [0.0, 0.0, tilt @ item.front_centre[:2]]
        items.append(replace(item, world_from_object=Rigid3(item.world_from_object.rotation, fallen)))
    layout = arrange(items, 0.0, floor_found=True)
    tops = np.array([o.world_from_object.translation[2] + o.dimensions_m[2] / 2 for o in layout.objects])
    assert np.ptp(tops) < 1e-3
    assert abs(tops.mean() - np.mean([i.world_from_object.translation[2] + i.dimensions_m[2] / 2 for i in items])) < 2e-3
    assert ["slope by up to 1.5°" in warning for warning in layout.warnings] == [True]
    assert max(layout.moves_m.values()) < 0.015  # the tilt is no error of an object


def test_a_shorter_neighbour_keeps_its_own_height() -> None:
    layout = arranged(
        Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7)), Unit("b", "cabinet", (0.503, 0, 0.45), (0.5, 0.58, 0.6))
    )
    np.testing.assert_allclose([o.dimensions_m[2] for o in layout.objects], [0.7, 0.6], atol=1e-9)


def test_a_thing_beside_a_step_does_not_overlap_the_step() -> None:
    """The support is lower than the step that the mug partly overhangs, which is too small a part to support the mug."""
    layout = arranged(
        Unit("step", "counter", (0.0, 0, 0.9), (0.6, 0.6, 0.04), kind="thing"),
        Unit("mug", "mug", (0.335, 0, 0.962), (0.1, 0.1, 0.1), kind="thing"),
        Unit("low", "counter", (0.7, 0, 0.89), (0.6, 0.6, 0.04), kind="thing"),
    )
    assert overlapping_pairs(layout.objects) == []


def test_furniture_is_not_moved_by_objects_on_top() -> None:
    layout = arranged(
        Unit("d", "drawer", (0, 0, 0.8), (0.6, 0.58, 0.2)),
        Unit("m", "microwave", (0, 0, 0.9 - 0.02 + 0.14), (0.5, 0.38, 0.28), kind="appliance"),
        manhattan=0.0,
    )
    assert layout.moves_m["d"] < 5e-4  # the microwave is 20 mm too low
    assert overlapping_pairs(layout.objects) == []


def test_an_unsolvable_layout_keeps_all_objects_with_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    def singular(*_: object) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(layout_module, "solved", singular)
    layout = arranged(*run_of_doors(0.0, 0.0))
    assert len(layout.objects) == len(run_of_doors(0.0, 0.0))
    assert any("the layout was not solved (Singular matrix)" in line for line in layout.warnings)
