"""RGB-D odometry on an exact textured room; untrackable frames are cut, or the recording is refused."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.registration import umeyama
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest import stage
from r2c2r_core.ingest.odometry import estimate_poses
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.model.capture import Depth, Frame

from .tiny import TinyRoom, write_seven_scenes

ROOM = TinyRoom(count=14, rgb_size=(192, 256), depth_size=(96, 128), focal=184.0)


def textured(room: TinyRoom, pose: Rigid3) -> np.ndarray:
    """A picture of spots a few centimetres wide that are fixed to the surfaces."""
    _, points = room._cast(pose, room.camera)
    waves = np.random.default_rng(5).normal(0, 40, (12, 3))
    value = sum(np.sin(points @ wave + 7 * k) for k, wave in enumerate(waves))
    return np.repeat((127 + 30 * value).clip(0, 255).astype(np.uint8)[..., None], 3, axis=2)


@dataclass
class Views:
    """The room seen along the poses; some frames may be blind (a finger on the lens)."""

    poses: list[Rigid3]
    blind: set[int] = field(default_factory=set)

    def rgb(self, index: int) -> np.ndarray:
        image = textured(ROOM, self.poses[index])
        return np.zeros_like(image) if index in self.blind else image

    def depth(self, index: int) -> Depth:
        metres = ROOM.depth(self.poses[index], ROOM.depth_camera).astype(np.float32)
        metres = np.zeros_like(metres) if index in self.blind else np.where(metres < 6, metres, np.float32(0))
        return Depth(metres, metres > 0)


def frames(count: int) -> list[Frame]:
    return [
        Frame(
            index=k,
            timestamp_s=None,
            rgb_camera=ROOM.camera,
            depth_camera=ROOM.depth_camera,
            world_from_camera=Rigid3(),
            sharpness=1.0,
        )
        for k in range(count)
    ]


def tracked(views: Views):
    return estimate_poses(frames(len(views.poses)), views, most_keyframes=40, far_m=5.0)


def test_odometry_is_accurate_to_a_centimetre_on_a_one_metre_walk():
    truth = ROOM.poses()
    result = tracked(Views(truth))
    assert result.evidence.source == "odometry"
    assert len(result.frames) == len(truth)
    found, wanted = (
        np.array([p.translation for p in poses]) for poses in ([f.world_from_camera for f in result.frames], truth)
    )
    fit = umeyama(found, wanted, scale=1.0)
    assert np.linalg.norm(fit.apply(found) - wanted, axis=1).max() < 0.01
    assert np.linalg.norm(wanted[-1] - wanted[0]) > 0.8
    assert any("no poses" in n for n in result.notices)


def test_a_tracking_break_reduces_the_recording_to_its_longest_segment():
    result = tracked(Views(ROOM.poses(), blind={3}))
    assert [f.index for f in result.frames] == list(range(4, 14))
    assert any("frames 4 to 13" in n and "10 of 14" in n for n in result.notices)


def test_a_recording_that_cannot_be_tracked_is_rejected():
    with pytest.raises(CaptureError, match="tracked continuously"):
        tracked(Views(ROOM.poses(), blind={2, 5, 8, 11}))


def test_a_recording_without_poses_is_tracked_and_levelled(tmp_path, monkeypatch):
    class Spotted(TinyRoom):
        def image(self, pose, camera):
            return textured(self, pose)

    room = Spotted(count=14, rgb_size=(192, 256), depth_size=(96, 128), focal=184.0)
    folder = write_seven_scenes(tmp_path / "kitchen", room)

    def without_poses(source):
        recording = open_recording(source)
        bare = tuple(stage.replace(f, capture_from_camera=None) for f in recording.frames)
        return stage.replace(recording, frames=bare)

    monkeypatch.setattr(stage, "open_recording", without_poses)
    capture = read_capture(folder, tmp_path / "store", IngestConfig(finest_voxel_m=0.03, coarsest_voxel_m=0.03))
    assert capture.poses.source == "odometry"
    assert capture.room.up_source == "floor"  # the file's gravity refers to a missing world frame
    expected = room.poses()[3].rotation[2]
    assert np.degrees(np.arccos(capture.frames[3].world_from_camera.rotation[2] @ expected)) < 0.7
    assert capture.frames[3].world_from_camera.translation[2] == pytest.approx(room.poses()[3].translation[2], abs=0.02)
