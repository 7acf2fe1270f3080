from dataclasses import replace

import numpy as np
import pytest
import trimesh

from r2c2r_core.geometry.transforms import Similarity3, rotation_about_z
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.inputs import ObjectOverride
from r2c2r_core.synthesize.dimensions import MeasuredObject, measure_object
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit


def measure(
    unit: Unit, *, override: ObjectOverride | None = None, walls: tuple[Wall, ...] = (), seed: int = 0
) -> MeasuredObject:
    track, placement, asset = placed_unit(unit, np.random.default_rng(seed))
    spec = category_of(unit.category)
    return measure_object(capture(walls), track, placement, asset, spec, override or ObjectOverride())


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.3, 2.6, -2.0])
def test_a_yawed_box_is_measured_within_one_percent_without_its_handle(yaw: float) -> None:
    unit = Unit("a", "cabinet", (0.3, 0.2, 0.5), (0.6, 0.58, 0.7), yaw=yaw, handle=Handle(0.24, 0.2), with_track_front=False)
    at = (0.3 + 3 * np.sin(yaw), 0.2 - 3 * np.cos(yaw), 1.4)
    track, placement, asset = placed_unit(unit, np.random.default_rng(1))
    found = measure_object(capture(camera_at=at), track, placement, asset, category_of("cabinet"), ObjectOverride())
    np.testing.assert_allclose(found.dimensions_m, unit.size, rtol=0.01)
    np.testing.assert_allclose(found.world_from_object.rotation, unit.world_from_object.rotation, atol=0.01)
    np.testing.assert_allclose(found.world_from_object.translation, unit.centre, atol=0.004)


def test_the_handle_is_measured_from_the_mesh_alone() -> None:
    found = measure(Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7), handle=Handle(0.24, 0.2), with_track_front=False))
    assert found.handle is not None
    np.testing.assert_allclose(found.handle.centre, (0.24, 0.2), atol=0.01)
    assert found.handle.protrusion_m == pytest.approx(0.035, abs=0.004)


def test_the_front_measured_in_frames_overrides_mesh_width_and_height() -> None:
    unit = Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7))
    track, placement, asset = placed_unit(unit, np.random.default_rng(0), stretch=(1.06, 1.0, 0.95))
    found = measure_object(capture(), track, placement, asset, category_of("cabinet"), ObjectOverride())
    np.testing.assert_allclose(found.dimensions_m[[0, 2]], [0.6, 0.7])
    assert found.sources == ("measured", "inferred", "measured")


def test_a_depth_that_crosses_the_wall_is_cut_at_the_wall() -> None:
    wall = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=-0.2, area_m2=4.0)  # the plane y = 0.2, seen from y < 0.2
    found = measure(Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7)), walls=(wall,))
    assert found.dimensions_m[1] == pytest.approx(0.49, abs=0.004)
    assert found.sources[1] == "inferred"


def test_an_implausible_depth_is_replaced_by_the_category_default() -> None:
    found = measure(Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.05, 0.7)))
    assert found.sources[1] == "default"
    assert found.dimensions_m[1] == pytest.approx(0.58)


def test_a_depth_millimetres_beyond_the_largest_sold_is_limited_and_not_replaced() -> None:
    found = measure(Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.804, 0.7)))
    assert found.dimensions_m[1] == pytest.approx(0.80)
    assert found.sources[1] == "inferred"


def test_a_size_and_pose_set_by_a_person_override_measurements() -> None:
    pose = np.eye(4)
    pose[:3, 3] = (1.0, 2.0, 0.4)
    override = ObjectOverride(dimensions_m=np.array([0.5, 0.5, 0.6]), pose=pose)
    found = measure(Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7)), override=override)
    np.testing.assert_allclose(found.dimensions_m, [0.5, 0.5, 0.6])
    np.testing.assert_allclose(found.world_from_object.translation, [1.0, 2.0, 0.4])
    assert found.sources == ("person", "person", "person")


def test_a_size_set_by_a_person_keeps_the_front_face_in_place() -> None:
    unit = Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7))
    found = measure(unit, override=ObjectOverride(dimensions_m=np.array([0.5, 0.4, 0.6])))
    np.testing.assert_allclose(found.front_centre, [0.0, -0.29, 0.5], atol=1e-6)


@pytest.mark.parametrize(("seen_to_m", "source"), [(0.58, "measured"), (0.40, "inferred"), (0.80, "inferred")])
def test_the_depth_of_a_unit_is_measured_only_if_its_side_is_seen_to_end_there(seen_to_m: float, source: str) -> None:
    track, placement, asset = placed_unit(Unit("a", "cabinet", (0, 0.29, 0.5), (0.6, 0.58, 0.7)), np.random.default_rng(0))
    scan, (y, z) = capture(), np.meshgrid(np.arange(0.0, seen_to_m, 0.01), np.arange(0.16, 0.84, 0.01))
    side = np.column_stack([np.full(y.size, -0.3), y.ravel(), z.ravel()])
    scan = replace(scan, surface=replace(scan.surface, vertices_world=side))
    found = measure_object(scan, track, placement, asset, category_of("cabinet"), ObjectOverride())
    assert found.sources[1] == source


CARTON = Unit("a", "box", (0, 0, 1.0), (0.19, 0.08, 0.29), kind="thing")


def carton_seen(points: np.ndarray, parameters: dict[str, float] | None = None) -> MeasuredObject:
    """The carton, in a scan with these observed points."""
    track, placement, asset = placed_unit(CARTON, np.random.default_rng(0))
    scan = capture()
    scan = replace(scan, surface=replace(scan.surface, vertices_world=points))
    asset = replace(asset, parameters=parameters or {})
    return measure_object(scan, track, placement, asset, category_of("box"), ObjectOverride())


def face(axis: int, at: float) -> np.ndarray:
    """Points of one face of the carton, half a centimetre apart, with the depth's noise."""
    half = np.array(CARTON.size) / 2
    grid = np.meshgrid(*[np.arange(-h, h, 0.005) if k != axis else [at] for k, h in enumerate(half)], indexing="ij")
    points = np.stack(grid, axis=-1).reshape(-1, 3) + CARTON.centre
    return np.asarray(points + np.random.default_rng(1).normal(scale=0.003, size=points.shape))


def test_the_depth_of_a_carton_is_measured_only_if_a_face_shows_it() -> None:
    front, top, left = face(1, -0.04), face(2, 0.145), face(0, -0.095)
    alone = carton_seen(front)
    assert alone.sources == ("measured", "inferred", "measured")
    assert any("no frame shows how deep" in warning for warning in alone.warnings)
    for shown in (top, left):
        seen = carton_seen(np.concatenate([front, shown]))
        assert seen.sources[1] == "measured"
        assert not seen.warnings


def test_an_outline_depth_with_low_sigma_counts_as_measured() -> None:
    front = face(1, -0.04)
    assert carton_seen(front, {"boxed": 1.0, "depth_sigma_m": 0.003}).sources[1] == "measured"
    assert carton_seen(front, {"boxed": 1.0, "depth_sigma_m": 0.03}).sources[1] == "inferred"


def test_the_depth_of_a_round_thing_is_inferred_without_a_warning() -> None:
    found = carton_seen(face(1, -0.04), {"revolved": 1.0})
    assert found.sources[1] == "inferred"
    assert not found.warnings


@pytest.mark.parametrize("turn_deg", [12.0, 40.0])
def test_a_round_thing_takes_the_yaw_of_its_box_and_a_carton_keeps_its_own(turn_deg: float) -> None:
    """A rotated carton keeps its own axes."""
    track, placement, asset = placed_unit(CARTON, np.random.default_rng(0))
    at = placement.world_from_mesh
    turned = Similarity3(at.scale, rotation_about_z(np.radians(turn_deg)) @ at.rotation, at.translation)
    placement = replace(placement, world_from_mesh=turned)
    solid = trimesh.creation.cylinder(radius=0.04, height=0.2, sections=32)
    upright = turned.inverse.apply(np.asarray(solid.vertices) @ rotation_about_z(np.radians(turn_deg)).T + CARTON.centre)
    drum = replace(asset, mesh=replace(asset.mesh, vertices=upright, faces=np.asarray(solid.faces)))
    yaws = []
    for item in (drum, asset):
        found = measure_object(capture(), track, placement, item, category_of("box"), ObjectOverride())
        yaws.append(np.degrees(np.arctan2(*found.world_from_object.rotation[[1, 0], 0])) % 90)
    assert yaws == pytest.approx([0.0, turn_deg], abs=1.0)


@pytest.mark.parametrize(("bottom_m", "said"), [(0.0, "inferred"), (0.02, "inferred"), (0.85, "measured")])
def test_the_height_of_an_appliance_that_ends_at_the_floor_is_inferred(bottom_m: float, said: str) -> None:
    unit = Unit("f", "fridge", (0.0, 0.0, bottom_m + 0.8), (0.6, 0.7, 1.6), kind="appliance")
    found = measure(unit)
    assert found.sources[2] == said
    np.testing.assert_allclose(found.dimensions_m[2], 1.6, atol=0.01)
    assert measure(Unit("c", "cabinet", (0.0, 0.0, 0.36), (0.6, 0.58, 0.7))).sources[2] == "measured"  # its edge is visible


@pytest.mark.parametrize(("scale", "depth_m", "source"), [(1.01, 0.60, "measured"), (1.10, 0.63, "inferred")])
def test_an_observed_depth_replaces_that_of_a_mesh_of_nearly_this_depth(scale: float, depth_m: float, source: str) -> None:
    unit = Unit("a", "refrigerator", (0, 0, 0.9), (0.6, 0.60, 1.8), kind="appliance")
    track, placement, asset = placed_unit(unit, np.random.default_rng(0), stretch=(1.0, scale, 1.0))
    track = replace(track, box=replace(track.box, depth_seen=True))
    found = measure_object(capture(), track, placement, asset, category_of("refrigerator"), ObjectOverride())
    assert found.dimensions_m[1] == pytest.approx(depth_m, abs=1e-3)
    assert found.sources[1] == source
