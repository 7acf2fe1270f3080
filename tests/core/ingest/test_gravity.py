"""Levelling, exact on an exact room for any orientation of the recording's world."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.errors import OverrideError
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.ingest.gravity import level_room
from r2c2r_core.ingest.planes import SurfaceSample, find_planes
from r2c2r_core.model.inputs import Overrides

TILTS = [(0.0, 0.0, 0.0), (90.0, 0.0, 0.0), (70.0, 12.0, -25.0), (-120.0, 40.0, 10.0)]


LINING = ((0.9, 2.42, 0.95), (1.3, 0, 0), (0, 0, 0.6), (0, -1, 0))  # 8 cm before the wall y = 2.5


def kitchen(noise_m: float = 0.004, *more: tuple[tuple[float, ...], ...]) -> SurfaceSample:
    """Floor z = 0, two walls, a base unit 0.9 m high along one of them, and `more`; oriented points, +Z up."""
    rng = np.random.default_rng(3)
    rectangles = [  # origin, edge, edge, normal
        ((0, 0, 0), (3, 0, 0), (0, 2.5, 0), (0, 0, 1)),
        ((0, 2.5, 0), (3, 0, 0), (0, 0, 2.2), (0, -1, 0)),
        ((3, 0, 0), (0, 2.5, 0), (0, 0, 2.2), (-1, 0, 0)),
        ((0.3, 1.9, 0), (2, 0, 0), (0, 0, 0.9), (0, -1, 0)),
        ((0.3, 1.9, 0.9), (2, 0, 0), (0, 0.6, 0), (0, 0, 1)),
        *more,
    ]
    points, normals = [], []
    for origin, a, b, normal in rectangles:
        count = int(1500 * np.linalg.norm(np.cross(a, b)))
        share = rng.random((count, 2))
        spot = np.array(origin) + share @ np.array([a, b], dtype=float)
        points.append(spot + rng.normal(0, noise_m, (count, 1)) * np.array(normal))
        turned = np.array(normal) + rng.normal(0, 0.08, (count, 3))
        normals.append(turned / np.linalg.norm(turned, axis=1, keepdims=True))
    return SurfaceSample(points=np.vstack(points), normals=np.vstack(normals), area_each_m2=1 / 1500)


def cameras() -> list[Rigid3]:
    """A person at 1.5 m looking around the corner, 25 deg down."""
    poses = []
    for yaw in np.linspace(-20, 70, 10):
        forward = np.array([np.sin(np.radians(yaw)), np.cos(np.radians(yaw)), -0.45])
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        poses.append(Rigid3(np.column_stack([right, np.cross(forward, right), forward]), np.array([0.8, 0.4, 1.5])))
    return poses


def moved(sample: SurfaceSample, transform: Rigid3) -> SurfaceSample:
    return SurfaceSample(
        points=transform.apply(sample.points), normals=transform.turn(sample.normals), area_each_m2=sample.area_each_m2
    )


def levelled(euler_deg, file_up=None, overrides=None, yaw_deg=17.0):
    world = Rigid3(Rotation.from_euler("xyz", euler_deg, degrees=True).as_matrix(), np.array([0.4, -1.2, 0.7]))
    world = world @ Rigid3(rotation_about_z(np.radians(yaw_deg)), np.zeros(3))
    up = world.rotation @ [0.0, 0.0, 1.0]
    if file_up is not None:
        file_up = Rotation.from_rotvec(np.radians(file_up) * np.cross(up, [0.31, 0.2, 0.9])).apply(up)
    result = level_room(moved(kitchen(), world), [world @ c for c in cameras()], file_up, overrides, np.random.default_rng(0))
    error_deg = np.degrees(np.arccos(np.clip((result.world_from_capture.rotation @ up)[2], -1, 1)))
    return result, world, error_deg


@pytest.mark.parametrize("euler_deg", TILTS)
def test_up_and_floor_are_estimated_from_planes_without_gravity_data(euler_deg):
    result, world, error_deg = levelled(euler_deg)
    assert result.room.up_source == "floor"
    assert error_deg < 0.1
    floor_points = (result.world_from_capture @ world).apply(kitchen(0.0).points[:3000])
    assert np.abs(floor_points[:, 2]).max() < 0.008


@pytest.mark.parametrize("off", [1.8, 2.4, 5.0, 8.0, 20.0])
def test_gravity_in_the_file_is_corrected_where_many_planes_agree(off):
    result, _, error_deg = levelled((90, 0, 0), file_up=off)
    assert error_deg < 0.1
    assert result.room.up_corrected
    assert result.room.up_file_off_deg == pytest.approx(off, rel=0.06)  # the rotation of `levelled` is not about a unit axis
    assert any("corrected by" in notice for notice in result.notices)


def test_a_single_conflicting_plane_does_not_override_the_files_gravity():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.random((4000, 2)) * 2, rng.normal(0, 0.003, 4000)])  # could be a ramp
    ramp = SurfaceSample(points=points, normals=np.tile([0.0, 0.0, 1.0], (4000, 1)), area_each_m2=1e-3)
    up = Rotation.from_euler("x", 5, degrees=True).apply([0.0, 0.0, 1.0])
    result = level_room(ramp, cameras(), up, None, np.random.default_rng(0))
    assert np.allclose(result.world_from_capture.rotation @ up, [0, 0, 1])
    assert not result.room.up_corrected
    assert result.room.up_file_off_deg == pytest.approx(5.0, abs=0.1)


@pytest.mark.parametrize("first", [0, 1, 2])
def test_planes_select_among_ambiguous_gravity_directions(first):
    readings = [np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.0, 0.87]), np.array([0.0, -0.64, 0.77])]
    ordered = [readings[first], *(r for r in readings if r is not readings[first])]
    result = level_room(kitchen(), cameras(), ordered[0], None, np.random.default_rng(0), other_ups=ordered[1:])
    assert (result.world_from_capture.rotation @ [0.0, 0.0, 1.0])[2] > 0.99999
    assert result.room.up_file_off_deg < 1.0


def turned(poses: list[Rigid3], quarters: int) -> list[Rigid3]:
    """The cameras of the same pictures, stored rotated."""
    turn = np.rint(rotation_about_z(quarters * np.pi / 2))
    return [Rigid3(pose.rotation @ turn, pose.translation) for pose in poses]


def walk() -> list[Rigid3]:
    """The cameras, carried sideways and back by a metre."""
    return [Rigid3(c.rotation, c.translation + np.array([0.1 * k, 0.0, 0.01 * k])) for k, c in enumerate(cameras())]


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_images_stored_sideways_without_gravity_do_not_rotate_the_room(quarters):
    result = level_room(kitchen(), turned(walk(), quarters), None, None, np.random.default_rng(0))
    assert (result.world_from_capture.rotation @ [0.0, 0.0, 1.0])[2] > 0.9999
    assert any(("lie on their side" in n) == (quarters in (1, 3)) for n in result.notices)
    assert (result.room.up_rival_capture is not None) == (quarters in (1, 3))  # reported as doubtful


def test_up_is_ambiguous_without_gravity_where_the_camera_hardly_moved():
    still = cameras()[2:3]  # facing a wall
    room = level_room(kitchen(), still, None, None, np.random.default_rng(0)).room
    assert abs(room.up_rival_capture[2]) < 0.01  # portrait and landscape are equally possible
    assert level_room(kitchen(), still, np.array([0.0, 0.0, 1.0]), None, np.random.default_rng(0)).room.up_rival_capture is None


def test_correct_gravity_in_the_file_is_unchanged():
    result, _, error_deg = levelled((90, 0, 0), file_up=0.0)
    assert error_deg < 1e-6
    assert result.notices == ()


def test_yaw_matches_the_walls_modulo_90_degrees():
    for yaw_deg in (3.0, 31.0, 88.0):
        result, world, _ = levelled((90, 0, 0), file_up=0.0, yaw_deg=yaw_deg)
        axis = (result.world_from_capture.rotation @ world.rotation)[:, 0]
        expected = np.mod(np.arctan2(axis[1], axis[0]), np.pi / 2)
        off = np.mod(result.room.manhattan_yaw_rad - expected + np.pi / 4, np.pi / 2) - np.pi / 4
        assert abs(np.degrees(off)) < 0.15


def test_walls_face_into_the_room_and_cabinet_fronts_are_not_walls():
    result, world, _ = levelled((90, 0, 0), file_up=0.0)
    here = result.world_from_capture @ world
    assert len(result.room.walls) == 2
    for normal, spot in (((0, -1, 0), (1, 2.5, 1)), ((-1, 0, 0), (3, 1, 1))):
        facing, place = here.rotation @ np.array(normal, float), here.apply(np.array([spot], float))[0]
        wall = max(result.room.walls, key=lambda w: w.normal @ facing)
        assert wall.normal @ facing > 0.9999
        assert wall.normal @ place == pytest.approx(wall.offset_m, abs=0.005)


def test_user_overrides_of_up_floor_and_yaw_are_applied():
    up = Rotation.from_euler("x", 90, degrees=True).as_matrix() @ np.array([0.05, 0.0, 1.0])
    overrides = Overrides(objects={}, up_capture=up, floor_m=0.25, manhattan_yaw_rad=0.4)
    result, _, _ = levelled((90, 0, 0), file_up=0.0, overrides=overrides)
    assert result.room.up_source == "person"
    assert result.room.floor_found
    assert result.room.manhattan_yaw_rad == pytest.approx(0.4)
    assert np.allclose(result.world_from_capture.rotation @ (up / np.linalg.norm(up)), [0, 0, 1])
    on_floor = up / np.linalg.norm(up) * 0.25
    assert result.world_from_capture.apply(on_floor[None])[0, 2] == pytest.approx(0.0, abs=1e-9)


def test_user_overrides_set_the_source_and_keep_the_measured_spread():
    up = Rotation.from_euler("x", 90, degrees=True).as_matrix() @ np.array([0.0, np.sin(0.02), np.cos(0.02)])
    walls = (np.array([0.0, -2.0, -5.0]),)
    overrides = Overrides(objects={}, up_capture=up, floor_m=0.25, manhattan_yaw_rad=0.4, walls=walls)
    room = levelled((90, 0, 0), file_up=0.0, overrides=overrides)[0].room
    assert (room.up_source, room.floor_source, room.yaw_source, room.walls_source) == ("person",) * 4
    assert room.up_spread_deg == pytest.approx(np.degrees(0.02), abs=0.5)  # the planes disagree, which the spread shows
    assert np.allclose(room.walls[0].normal, [0, -1, 0])
    assert room.walls[0].offset_m == pytest.approx(-2.5)


def test_a_clean_room_has_small_uncertainties():
    room = levelled((90, 0, 0), file_up=0.0)[0].room
    assert (room.floor_source, room.yaw_source, room.walls_source) == ("surface",) * 3
    assert room.up_spread_deg < 0.2
    assert room.yaw_spread_deg < 0.2
    assert room.floor_spread_m == pytest.approx(0.004, abs=0.001)  # the noise level of the simulation
    assert all(w.spread_m == pytest.approx(0.004, abs=0.001) for w in room.walls)


def test_a_wall_lining_is_a_separate_wall_with_its_own_extent():
    rng = np.random.default_rng(0)
    room = level_room(kitchen(0.004, LINING), cameras(), np.array([0.0, 0.0, 1.0]), None, rng).room
    (lining,) = [wall for wall in room.walls if wall.span_m is not None]
    assert len(room.walls) == 3
    assert lining.offset_m == pytest.approx(-2.42, abs=0.005)
    assert lining.span_m == pytest.approx((0.9, 2.2), abs=0.05)


def test_a_wall_override_with_a_zero_normal_is_rejected():
    with pytest.raises(OverrideError, match="no direction"):
        levelled((90, 0, 0), file_up=0.0, overrides=Overrides(objects={}, walls=(np.zeros(3),)))


def test_a_table_top_alone_is_not_taken_for_the_floor():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.random((4000, 2)) * 2, rng.normal(0.73, 0.003, 4000)])
    sample = SurfaceSample(points=points, normals=np.tile([0.0, 0.0, 1.0], (4000, 1)), area_each_m2=1e-3)
    pose = Rigid3(cameras()[0].rotation, np.array([0.5, -0.5, 1.35]))
    result = level_room(sample, [pose], np.array([0.0, 0.0, 1.0]), None, np.random.default_rng(0))
    assert not result.room.floor_found
    assert any("no floor" in n for n in result.notices)


def test_without_planes_up_and_yaw_are_marked_as_assumed():
    sample = SurfaceSample(points=np.zeros((0, 3)), normals=np.zeros((0, 3)), area_each_m2=0.0)
    result = level_room(sample, cameras(), None, None, np.random.default_rng(0))
    assert result.room.up_source == "assumed"
    assert result.room.yaw_source == "assumed"
    assert (result.room.up_spread_deg, result.room.floor_spread_m, result.room.yaw_spread_deg) == (None, None, None)
    assert result.room.walls == ()


def test_detected_planes_have_the_correct_area():
    planes = find_planes(kitchen(), np.random.default_rng(0))
    assert [round(p.area_m2, 1) for p in planes] == pytest.approx([7.5, 6.6, 5.5, 1.8, 1.2], abs=0.3)
