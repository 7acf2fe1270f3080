"""Uncertainty of a pose: well and poorly constrained directions, in figures and in words."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.align.certainty import loose_ends, spread_of
from r2c2r_core.align.observe import Observation, observe
from r2c2r_core.align.residuals import Anchors
from r2c2r_core.align.shape import Shape, prepare_shape, spins_alike
from r2c2r_core.geometry.transforms import Rigid3, Similarity3, rotation_about_z
from r2c2r_core.model.placement import Spread
from r2c2r_core.model.track import FrontPanel

NOTHING = Anchors(up_mesh=None, up_weight=0.0, front=None, support_z_m=None)
IN_PLACE = Similarity3(1.0, np.eye(3), np.zeros(3))  # the mesh frames here are the world frame
SURE = Spread(
    turn_deg=0.2,
    turn_axis_world=np.array([0.0, 0.0, 1.0]),
    shift_m=0.002,
    shift_axis_world=np.array([1.0, 0.0, 0.0]),
    scale=0.004,
)


def seen(thing: Any, capture: Any, track: Any) -> tuple[Shape, Observation]:
    shape = prepare_shape(thing, point_count=4000, face_limit=4000, rng=np.random.default_rng(0))
    return shape, observe(capture, track, view_count=6, size_px=96, point_count=800)


@pytest.fixture(scope="module")
def box(bench: Any) -> tuple[Shape, Observation]:
    return seen(*bench.free_box(textured=False))


def test_a_box_seen_from_all_around_is_well_constrained(box: tuple[Shape, Observation]) -> None:
    spread = spread_of(IN_PLACE, *box, NOTHING, [])
    assert spread.turn_deg < 0.75
    assert spread.shift_m < 0.0075
    assert spread.scale < 0.01
    assert loose_ends(spread, None) == ()


def test_inconsistent_frames_increase_the_pose_uncertainty(box: tuple[Shape, Observation]) -> None:
    shape, observation = box
    first = observation.frame_index == observation.frame_index[0]
    apart = observation.points_world + np.where(first, 0.02, 0.0)[:, None] * observation.towards_camera
    torn = spread_of(IN_PLACE, shape, replace(observation, points_world=apart), NOTHING, [])
    assert torn.shift_m > 1.5 * spread_of(IN_PLACE, shape, observation, NOTHING, []).shift_m


def test_two_frames_constrain_a_pose_less_than_six(box: tuple[Shape, Observation]) -> None:
    shape, observation = box
    few = observation.views[:2]
    own = np.isin(observation.frame_index, [view.frame_index for view in few])
    part = replace(
        observation,
        views=few,
        points_world=observation.points_world[own],
        towards_camera=observation.towards_camera[own],
        noise_m=observation.noise_m[own],
        frame_index=observation.frame_index[own],
    )
    whole, pair = (spread_of(IN_PLACE, shape, o, NOTHING, []) for o in (observation, part))
    assert pair.shift_m > 1.9 * whole.shift_m  # a third as many measurements alone would give 1.7
    assert pair.turn_deg > 1.9 * whole.turn_deg


def test_a_single_view_constrains_scale_and_rotation_less_than_all_views(box: tuple[Shape, Observation]) -> None:
    shape, observation = box
    view = observation.views[0]
    own = observation.frame_index == view.frame_index
    part = replace(
        observation,
        views=(view,),
        points_world=observation.points_world[own],
        towards_camera=observation.towards_camera[own],
        noise_m=observation.noise_m[own],
        frame_index=observation.frame_index[own],
    )
    whole, alone = (spread_of(IN_PLACE, shape, o, NOTHING, []) for o in (observation, part))
    assert alone.scale > 1.5 * whole.scale
    assert alone.turn_deg > whole.turn_deg


def test_the_yaw_of_a_bottle_is_excluded_from_its_uncertainty(bench: Any) -> None:
    shape, observation = seen(*bench.bottle())
    assert spins_alike(shape, np.array([0.0, 0.0, 2.0]))
    assert not spins_alike(shape, np.array([1.0, 0.0, 0.0]))
    spread = spread_of(IN_PLACE, shape, observation, NOTHING, [])
    assert abs(spread.turn_axis_world[2]) < 0.3  # the tilt is reported


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"turn_deg": 1.0}, "its yaw is poorly constrained by the scan: it may be off by 2.0°"),
        ({"turn_deg": 1.0, "turn_axis_world": np.array([1.0, 0.0, 0.0])}, "its tilt is .* 2.0°"),
        ({"shift_m": 0.02, "shift_axis_world": np.array([0.0, 0.0, 1.0])}, "its height above the floor is .* 40 mm"),
        ({"scale": 0.03}, "its size is .* 6 %"),
    ],
)
def test_poorly_constrained_motions_are_reported(change: dict[str, Any], words: str) -> None:
    assert loose_ends(SURE, None) == ()
    (line,) = loose_ends(replace(SURE, **change), None)
    assert re.search(words, line)


def test_shifts_of_a_front_are_reported_along_or_from_the_wall() -> None:
    facing_x = Rigid3(rotation_about_z(np.pi / 2), np.zeros(3))  # its width is along world y
    front = FrontPanel(world_from_front=facing_x, width_m=0.6, height_m=0.7, handle=None, confidence=1.0)
    (slides,) = loose_ends(replace(SURE, shift_m=0.02, shift_axis_world=np.array([0.0, 1.0, 0.0])), front)
    assert slides == "its place along the wall is poorly constrained by the scan: it may be off by 40 mm"
    (deep,) = loose_ends(replace(SURE, shift_m=0.02, shift_axis_world=np.array([1.0, 0.0, 0.0])), front)
    assert "its distance from the wall" in deep
