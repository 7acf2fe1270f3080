"""Up direction from gravity, planes, cameras or a person, in a room of known up and any orientation, and the file's value."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.errors import OverrideError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.planes import Plane
from r2c2r_core.ingest.up import choose_up, find_up

Z = np.array([0.0, 0.0, 1.0])
UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # a camera that looks along +y, its top up


def plane(normal: tuple[float, float, float], area_m2: float) -> Plane:
    return Plane(normal=np.array(normal), offset_m=0.0, area_m2=area_m2, points=np.zeros((0, 3)))


FLOOR, NORTH, EAST, WEST = plane((0, 0, 1), 2.0), plane((0, -1, 0), 3.0), plane((-1, 0, 0), 2.5), plane((1, 0, 0), 2.5)
ROOM = (FLOOR, NORTH, EAST, WEST)


def turned(planes: tuple[Plane, ...], rotation: np.ndarray) -> list[Plane]:
    return [replace(p, normal=p.normal @ rotation.T) for p in planes]


def tilted(deg: float) -> np.ndarray:
    """Up, tilted by that many degrees in an arbitrary direction."""
    return Rotation.from_rotvec(np.radians(deg) * np.array([0.6, 0.8, 0.0])).apply(Z)


def walking(rotation: np.ndarray) -> list[Rigid3]:
    """Cameras held upright at 1.5 m by a person who turns around, in a world rotated by `rotation`."""
    yaws = Rotation.from_euler("z", np.linspace(-60, 60, 9)[:, None], degrees=True).as_matrix()
    places = np.column_stack([np.linspace(0, 2, 9), np.zeros(9), np.full(9, 1.5)])
    return [Rigid3(rotation @ yaw @ UPRIGHT, rotation @ place) for yaw, place in zip(yaws, places, strict=True)]


def degrees_between(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b, -1, 1))))


@pytest.mark.parametrize("seed", range(4))
def test_planes_recover_the_up_direction_of_a_rotated_room(seed: int) -> None:
    rotation = Rotation.random(random_state=seed).as_matrix()
    found = find_up(turned(ROOM, rotation), rotation @ tilted(7.0), 10.0)
    assert found is not None
    assert degrees_between(found[0], rotation @ Z) < 0.01
    assert found[1] < 0.01


def test_parallel_walls_do_not_determine_up() -> None:
    assert find_up([NORTH, plane((0, 1, 0), 3.0)], tilted(3.0), 10.0) is None
    assert find_up([], Z, 10.0) is None
    corner = find_up([NORTH, EAST], tilted(3.0), 10.0)  # two planes that face differently determine it: the line they share
    assert corner is not None
    assert degrees_between(corner[0], Z) < 0.01


@pytest.mark.parametrize(("said_deg", "planes", "kept"), [(0.5, ROOM, True), (2.0, ROOM, False), (2.0, (NORTH, EAST), True)])
def test_the_files_gravity_is_kept_unless_floor_and_walls_contradict_it(
    said_deg: float, planes: tuple[Plane, ...], kept: bool
) -> None:
    """Half a degree is within a phone's own error; without a level surface gravity is not corrected."""
    up = choose_up(planes, (), [tilted(said_deg)], None)
    assert up.source == "file"
    assert up.corrected == (not kept)
    assert degrees_between(up.direction, tilted(said_deg) if kept else Z) < 0.05
    assert up.file_off_deg == pytest.approx(said_deg, abs=0.05)
    assert (up.notices == ()) == kept


def test_only_many_planes_override_a_large_gravity_error() -> None:
    few = choose_up([plane((0, 0, 1), 0.6), NORTH], (), [tilted(8.0)], None)
    assert not few.corrected
    assert degrees_between(few.direction, tilted(8.0)) < 1e-6
    many = choose_up(ROOM, (), [tilted(8.0)], None)
    assert many.corrected
    assert many.source == "floor"
    assert degrees_between(many.direction, Z) < 0.05


def test_planes_select_between_two_gravity_candidates() -> None:
    wrong = np.array([0.6, 0.8, 0.0])
    assert degrees_between(choose_up(ROOM, (), [wrong, Z], None).direction, Z) < 0.05
    assert degrees_between(choose_up(ROOM, (), [Z, wrong], None).direction, Z) < 0.05


@pytest.mark.parametrize("seed", range(3))
def test_without_gravity_up_is_found_from_planes_and_camera_poses(seed: int) -> None:
    rotation = Rotation.random(random_state=seed).as_matrix()
    up = choose_up(turned(ROOM, rotation), walking(rotation), (), None)
    assert up.source == "floor"
    assert degrees_between(up.direction, rotation @ Z) < 0.05
    assert "has no gravity" in up.notices[0]


def test_without_gravity_and_planes_up_is_assumed_from_the_cameras() -> None:
    up = choose_up((), walking(np.eye(3)), (), None)
    assert up.source == "assumed"
    assert degrees_between(up.direction, Z) < 1e-6
    assert "check it" in up.notices[0]


def test_a_user_up_direction_is_used_and_zero_or_nan_is_rejected() -> None:
    up = choose_up(ROOM, (), [Z], np.array([0.0, 2.0, 0.0]))
    assert up.source == "person"
    np.testing.assert_allclose(up.direction, [0, 1, 0])
    for nothing in ([0.0, 0.0, 0.0], [np.nan, 0.0, 1.0]):
        with pytest.raises(OverrideError, match="'up' has no direction"):
            choose_up(ROOM, (), [Z], np.array(nothing))
