"""The doctor calls a good recording good, and names what is wrong with a bad one."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3
from r2c2r_core.ingest.doctor import examine
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.model.capture import Capture, Frame

from .tiny import TinyRoom, write_r3d


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Capture:
    folder = tmp_path_factory.mktemp("doctor")
    room = TinyRoom(count=24)
    config = IngestConfig(finest_voxel_m=0.03, coarsest_voxel_m=0.03)
    return read_capture(write_r3d(folder / "scan.r3d", room), folder / "store", config)


def with_frames(capture: Capture, change) -> Capture:
    return replace(capture, frames=tuple(change(k, f) for k, f in enumerate(capture.frames)))


def posed(frame: Frame, pose: Rigid3) -> Frame:
    return replace(frame, world_from_camera=pose)


def test_a_good_recording_is_good(capture):
    report = examine(capture)
    assert report.verdict == "good", report.reasons
    assert report.reasons == ()
    assert report.figures.frames == 24
    assert (
        report.figures.pair_error_mm < 12
    )  # a pixel of the tiny depth image is 4 cm wide, and the neighbour is looked up nearest
    assert report.figures.depth_coverage > 0.9
    assert report.figures.fps == pytest.approx(60)


def test_a_wrong_camera_convention_makes_it_unusable(capture):
    def flip(_, frame):
        pose = frame.world_from_camera
        return posed(frame, Rigid3(pose.rotation @ CAMERA_CV_FROM_GL, pose.translation))

    report = examine(with_frames(capture, flip))
    assert report.verdict == "unusable"
    assert report.remarks[0].cause == "camera_axes"


def test_poses_the_other_way_round_make_it_unusable(capture):
    report = examine(with_frames(capture, lambda _, f: posed(f, f.world_from_camera.inverse)))
    assert report.verdict == "unusable"


def test_a_jump_of_the_tracking_is_told(capture):
    def jump(k, frame):
        pose = frame.world_from_camera
        return posed(frame, Rigid3(pose.rotation, pose.translation + np.array([0.5, 0, 0]) * (k >= 12)))

    report = examine(with_frames(capture, jump))
    assert report.figures.pose_jumps == 1
    assert report.verdict != "good"
    assert any(r.cause == "pose_jumps" for r in report.remarks)


def test_few_frames_no_floor_and_a_guessed_up_are_told(capture):
    poor = replace(capture, frames=capture.frames[:3], room=replace(capture.room, floor_found=False, up_source="assumed"))
    report = examine(poor)
    assert report.verdict == "unusable"
    assert "only 3 frames" in report.reasons[0]
    assert any("floor" in r for r in report.reasons)
    assert any("which way is up" in r for r in report.reasons)


def test_blur_is_told(capture):
    report = examine(with_frames(capture, lambda k, f: replace(f, sharpness=1.0 if k % 3 == 0 else 100.0)))
    assert any("blurred" in r for r in report.reasons)
