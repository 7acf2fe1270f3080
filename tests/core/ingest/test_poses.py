"""Pose drift is detected and removed on an exact room; correct poses, and other pose errors, are unchanged."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.poses import refine_poses
from r2c2r_core.model.capture import Depth, Frame

from .tiny import TinyRoom

ROOM = TinyRoom(count=20, depth_size=(96, 128), rgb_size=(96, 128))


@dataclass
class Views:
    """The room seen on a walk there and back, with a millimetre of noise."""

    poses: list[Rigid3]

    def depth(self, index: int) -> Depth:
        depth = ROOM.depth(self.poses[index], ROOM.depth_camera)
        noise = np.random.default_rng(index).normal(0, 0.001, depth.shape)
        metres = np.where(depth < 6, depth + noise, 0).astype(np.float32)
        return Depth(metres, metres > 0)


@pytest.fixture(scope="module")
def walk() -> tuple[list[Frame], Views]:
    there = ROOM.poses()
    poses = [*there, *(Rigid3(p.rotation, p.translation + np.array([0.02, -0.05, 0.08])) for p in reversed(there))]
    camera = ROOM.depth_camera
    frames = [
        Frame(index=k, timestamp_s=None, rgb_camera=ROOM.camera, depth_camera=camera, world_from_camera=p, sharpness=1.0)
        for k, p in enumerate(poses)
    ]
    return frames, Views(poses)


def drifted(frames: list[Frame], metres: float, degrees: float) -> list[Frame]:
    """Poses with an error that grows along the walk to the given size."""
    moved = []
    for share, frame in zip(np.linspace(0, 1, len(frames)), frames, strict=True):
        turn = Rotation.from_rotvec(np.radians(degrees) * share * np.array([0.6, 0.0, 0.8])).as_matrix()
        pose = frame.world_from_camera
        shift = metres * share * np.array([0.48, 0.64, 0.6])
        moved.append(replace(frame, world_from_camera=Rigid3(turn @ pose.rotation, pose.translation + shift)))
    return moved


def error_m(frames, truth: list[Rigid3]) -> float:
    """RMS displacement of a point 2 m ahead of each camera, up to one rigid motion of the whole."""
    from r2c2r_core.geometry.registration import umeyama

    ahead = np.array([[0.0, 0.0, 2.0], [0.5, 0.0, 1.0], [0.0, 0.5, 1.0]])
    found = np.concatenate([f.world_from_camera.apply(ahead) for f in frames])
    wanted = np.concatenate([p.apply(ahead) for p in truth])
    return float(np.sqrt(np.mean(np.sum((umeyama(found, wanted, scale=1.0).apply(found) - wanted) ** 2, axis=1))))


def refined(frames, views):
    return refine_poses(frames, views, most_keyframes=40, far_m=6.0)


def test_drift_of_3_cm_is_corrected_with_a_notice(walk):
    frames, views = walk
    bent = drifted(frames, 0.03, 1.5)
    result = refined(bent, views)
    assert result.evidence.source == "refined"
    assert "drifted and were corrected" in result.notices[0]  # not a fault that is left: the verdict may be good
    assert error_m(result.frames, views.poses) < 0.25 * error_m(bent, views.poses)
    assert error_m(result.frames, views.poses) < 0.003
    assert np.allclose(result.evidence.given, [f.world_from_camera.matrix for f in bent])


def test_pose_refinement_does_not_rotate_the_whole_room(walk):
    frames, views = walk
    bent = drifted(frames, 0.03, 1.5)
    result = refined(bent, views)
    turns = [a.world_from_camera.rotation @ b.world_from_camera.rotation.T for a, b in zip(result.frames, bent, strict=True)]
    mean = Rotation.from_matrix(np.array(turns)).mean().magnitude()
    assert np.degrees(mean) < 0.02


def test_frames_between_keyframes_are_corrected_too(walk):
    frames, views = walk
    bent = drifted(frames, 0.03, 1.5)
    result = refine_poses(bent, views, most_keyframes=24, far_m=6.0)
    assert error_m(result.frames, views.poses) < 0.005


def test_correct_poses_are_unchanged(walk):
    frames, views = walk
    result = refined(frames, views)
    assert result.evidence.source == "file"
    assert result.notices == ()
    assert all(a is b for a, b in zip(result.frames, frames, strict=True))


def test_a_wrong_pose_convention_is_not_treated_as_drift(walk):
    frames, views = walk
    wrong = [
        replace(
            f, world_from_camera=Rigid3(f.world_from_camera.rotation @ np.diag([1.0, -1, -1]), f.world_from_camera.translation)
        )
        for f in frames
    ]
    result = refined(wrong, views)
    assert result.evidence.source == "file"
    assert result.evidence.given_gap_m is None or result.evidence.given_gap_m > 0.015


def test_a_recording_without_loop_closure_keeps_its_poses(walk):
    frames, views = walk
    result = refined(drifted(frames, 0.03, 1.5)[:6], views)
    assert result.evidence.source == "file"
    assert result.evidence.gap_m is None
