"""Least change of all faces together: soft and hard bounds, independent of the frame."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.solve import Face, Tie, solved
from tests.core.motions import motion

GAP_M = 0.002
ATOL = 1e-5  # tolerance of a bound


def item(name: str, centre: tuple[float, float, float], *, category: str = "cabinet", fixed: bool = False) -> MeasuredObject:
    """A unit of 0.6 x 0.58 x 0.72 m whose front faces -Y."""
    pose = Rigid3(np.eye(3), np.array(centre))
    return MeasuredObject(
        name=name,
        category=category,
        spec=category_of(category),
        world_from_object=pose,
        dimensions_m=np.array([0.6, 0.58, 0.72]),
        sources=("measured", "measured", "measured"),
        handle=None,
        support_z_m=None,
        front_measured=True,
        confidence=1.0,
        fixed_by_person=fixed,
        placed_pose=pose,
        warnings=(),
    )


def low(item: MeasuredObject, axis: int) -> float:
    return float(item.world_from_object.translation[axis] - item.dimensions_m[axis] / 2)


def high(item: MeasuredObject, axis: int) -> float:
    return low(item, axis) + float(item.dimensions_m[axis])


def test_satisfied_constraints_change_nothing() -> None:
    items = [item("a", (0, 0, 0.5)), item("b", (0.603, 0, 0.5))]
    for before, after in zip(items, solved(items, [], [], GAP_M), strict=True):
        assert after is before
    kept = solved(items, [Tie(first=Face(0, 0, 1.0), second=Face(1, 0, -1.0), gap_m=0.003)], [(0, 1)], GAP_M)
    for before, after in zip(items, kept, strict=True):
        np.testing.assert_allclose(after.world_from_object.translation, before.world_from_object.translation, atol=ATOL)
        np.testing.assert_allclose(after.dimensions_m, before.dimensions_m, atol=ATOL)


@pytest.mark.parametrize("off_m", [-0.006, 0.006])
def test_tied_faces_are_aligned_and_equal_objects_share_the_change(off_m: float) -> None:
    first, second = solved(
        [item("a", (0, 0, 0.5)), item("b", (0.603, off_m, 0.5))],
        [Tie(first=Face(0, 1, -1.0), second=Face(1, 1, -1.0))],
        [],
        GAP_M,
    )
    assert low(first, 1) == pytest.approx(low(second, 1), abs=ATOL)
    assert low(first, 1) == pytest.approx(-0.29 + off_m / 2, abs=1e-4)


def test_overlaps_are_separated_along_the_cheapest_axis_with_the_gap() -> None:
    first, second = solved([item("a", (0, 0, 0.5)), item("b", (0.590, 0, 0.5))], [], [(0, 1)], GAP_M)
    assert low(second, 0) - high(first, 0) >= GAP_M - ATOL
    assert low(second, 0) - high(first, 0) < GAP_M + 1e-3
    assert [first.world_from_object.translation[k] for k in (1, 2)] == pytest.approx([0, 0.5], abs=ATOL)


def test_appliances_move_before_built_in_units_and_fixed_objects_stay() -> None:
    built_in, put_there = solved(
        [item("a", (0, 0, 0.5)), item("m", (0.590, 0, 0.5), category="microwave")], [], [(0, 1)], GAP_M
    )
    assert abs(high(built_in, 0) - 0.3) < 0.001
    assert low(put_there, 0) > 0.3
    kept, moved = solved([item("a", (0, 0, 0.5), fixed=True), item("b", (0.595, 0, 0.5))], [], [(0, 1)], GAP_M)
    assert high(kept, 0) == pytest.approx(0.3, abs=1e-9)
    assert low(moved, 0) >= 0.3 + GAP_M - ATOL


def test_objects_are_not_pushed_below_the_floor_or_further_below() -> None:
    for measured_m in (0.0, -0.004):
        below = item("a", (0, 0, 0.36 + measured_m), category="box")
        first, second = solved([below, item("b", (0, 0, 1.04), category="box")], [], [(0, 1)], GAP_M)
        assert low(first, 2) == pytest.approx(measured_m, abs=ATOL)
        assert low(second, 2) - high(first, 2) >= GAP_M - ATOL


def test_sizes_change_by_no_more_than_the_measurement_error() -> None:
    """Three units in too little space are moved, not shrunk."""
    items = [item(name, (x, 0, 0.5)) for name, x in (("a", 0.0), ("b", 0.56), ("c", 1.12))]
    found = solved(items, [], [(0, 1), (1, 2)], GAP_M)
    for before, after in zip(items, found, strict=True):
        assert (np.abs(after.dimensions_m - before.dimensions_m) < 0.0125).all()
    assert all(low(b, 0) - high(a, 0) > GAP_M - 1e-4 for a, b in pairwise(found))


@pytest.mark.parametrize("yaw", [0.4, np.pi / 2, 2.5])
def test_the_solution_does_not_depend_on_the_world_frame(yaw: float) -> None:
    motion = Rigid3(rotation_about_z(yaw), np.array([1.0, -2.0, 0.1]))

    def moved(one: MeasuredObject) -> MeasuredObject:
        return replace(one, world_from_object=motion @ one.world_from_object)

    items = [item("a", (0, 0, 0.5)), item("b", (0.590, 0.004, 0.5)), item("c", (1.19, 0, 0.5))]
    ties = [Tie(first=Face(k, 1, -1.0), second=Face(k + 1, 1, -1.0)) for k in range(2)]
    here = solved(items, ties, [(0, 1), (1, 2)], GAP_M)
    there = solved([moved(one) for one in items], ties, [(0, 1), (1, 2)], GAP_M)
    for one, other in zip(here, there, strict=True):
        np.testing.assert_allclose(other.world_from_object.matrix, moved(one).world_from_object.matrix, atol=1e-4)
        np.testing.assert_allclose(other.dimensions_m, one.dimensions_m, atol=1e-4)


def test_the_solution_does_not_depend_on_object_order() -> None:
    items = [item("a", (0, 0, 0.5)), item("b", (0.590, 0, 0.5)), item("c", (1.185, 0, 0.5))]
    here = solved(items, [], [(0, 1), (1, 2)], GAP_M)
    there = solved(items[::-1], [], [(2, 1), (1, 0)], GAP_M)[::-1]
    for one, other in zip(here, there, strict=True):
        np.testing.assert_allclose(other.world_from_object.translation, one.world_from_object.translation, atol=1e-4)


def test_an_overlap_is_resolved_where_an_edge_is_unsure() -> None:
    """The lower unit was measured 33 mm too high: its top edge was not seen, those of the upper unit were."""
    lower = replace(item("lower", (0, 0, 0.5)), edges=(0.98, 0.98, 0.1, 0.98))
    upper = replace(item("upper", (0, 0, 1.22 - 0.033)), edges=(0.98, 0.98, 0.98, 0.98))
    first, second = solved([lower, upper], [], [(0, 1)], GAP_M)
    assert low(second, 2) == pytest.approx(low(upper, 2), abs=0.002)
    assert high(first, 2) == pytest.approx(low(second, 2) - GAP_M, abs=2e-4)
    assert low(first, 2) == pytest.approx(low(lower, 2), abs=0.002)


def test_an_edge_at_which_a_front_was_filmed_to_turn_is_sure() -> None:
    """Both edges were found alike; the flap's hinge is filmed at its own."""
    turned = motion({0: 1.0}, "bottom", world_from_front=Rigid3(translation=np.array([0.0, -0.29, 1.22 - 0.033])))
    lower = replace(item("lower", (0, 0, 0.5)), edges=(0.98, 0.98, 0.4, 0.98))
    upper = replace(item("upper", (0, 0, 1.22 - 0.033)), edges=(0.98, 0.98, 0.98, 0.4), motions=(turned,))
    first, second = solved([lower, upper], [], [(0, 1)], GAP_M)
    assert abs(low(second, 2) - low(upper, 2)) < 0.1 * abs(high(first, 2) - high(lower, 2))
