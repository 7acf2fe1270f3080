"""The drawer that carries a thing: cameras moved as it closes, and the depth of its front."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.carrier import Carrier
from r2c2r_core.model.rectangle import Rectangle3
from tests.core.export.kitchen import capture
from tests.core.motions import motion
from tests.core.segment.scenes import look_at

AHEAD_M = 2.0


def seen_from(y: float) -> Capture:
    """Without depth, from a camera at that y before or behind a drawer at the origin, whose front faces -y."""
    frame = capture().frames[0]
    pose = look_at(np.array([0.0, y, 0.0]), np.zeros(3))
    carrier = Carrier(front=Rectangle3(world_from_front=Rigid3(), width_m=0.5, height_m=0.3), motion=motion({frame.index: 0.4}))
    return carrier.capture(replace(capture(), frames=(replace(frame, world_from_camera=pose),)), {frame.index: None})


def test_cameras_are_moved_as_the_drawer_closes() -> None:
    (frame,) = seen_from(-AHEAD_M).frames
    np.testing.assert_allclose(frame.world_from_camera.translation, [0.0, 0.4 - AHEAD_M, 0.0], atol=1e-9)


def test_missing_depth_on_the_front_is_that_of_the_front() -> None:
    moved = seen_from(-AHEAD_M)
    (frame,) = moved.frames
    depth, camera = moved.images.depth(frame.index), frame.depth_camera
    np.testing.assert_allclose(depth.metres[depth.valid], AHEAD_M - 0.4, atol=1e-6)
    expected_px = 0.5 * 0.3 * camera.fx * camera.fy / (AHEAD_M - 0.4) ** 2
    assert depth.valid.sum() == pytest.approx(expected_px, rel=0.02)


def test_a_front_seen_from_behind_hides_nothing() -> None:
    moved = seen_from(AHEAD_M)
    assert not moved.images.depth(moved.frames[0].index).valid.any()


def test_frames_without_a_known_state_are_left_out() -> None:
    carrier = Carrier(front=Rectangle3(world_from_front=Rigid3(), width_m=0.5, height_m=0.3), motion=motion({10_000: 0.4}))
    assert carrier.capture(capture(), {frame.index: None for frame in capture().frames}).frames == ()
