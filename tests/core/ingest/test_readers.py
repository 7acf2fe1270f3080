"""Every format gives the same room: poses, cameras, depth and colour, in our conventions."""

from dataclasses import astuple, replace

import lzfse
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.readers.images import colour_pixels
from r2c2r_core.ingest.readers.protocol import Recording
from r2c2r_core.ingest.readers.table import open_recording

from .tiny import YUP_FROM_ZUP, TinyRoom, arkit_rows, write_exr, write_r3d, write_seven_scenes, write_tum, zip_folder
from .tiny_formats import (
    write_arkitscenes,
    write_arti4d,
    write_nerfstudio,
    write_polycam,
    write_redwood,
    write_rtabmap,
    write_scanner_app,
    write_scannet,
    write_scannetpp,
    write_stray,
    write_threedmatch,
)

ROOM = TinyRoom()
HALF_STEP_M = 0.0011  # HALF steps by 2 mm between 2 and 4 m


def write(kind, tmp_path):
    if kind == "r3d":
        return write_r3d(tmp_path / "scan.r3d", ROOM)
    if kind == "r3d-folder":
        import zipfile

        zipfile.ZipFile(write_r3d(tmp_path / "scan.r3d", ROOM)).extractall(tmp_path / "scan")
        return tmp_path / "scan"
    if kind == "exr":
        return write_exr(tmp_path / "EXR_RGBD", ROOM)
    if kind == "exr-below":
        write_exr(tmp_path / "EXR_RGBD", ROOM)
        return tmp_path
    if kind.endswith("-zip"):
        return zip_folder(WRITERS[kind[:-4]](tmp_path / "made", ROOM), tmp_path / "made.zip", top="made/")
    return WRITERS[kind](tmp_path / "made", ROOM)


WRITERS = {
    "7scenes": write_seven_scenes,
    "tum": write_tum,
    "stray": write_stray,
    "polycam": write_polycam,
    "scanner-app": write_scanner_app,
    "arkitscenes": write_arkitscenes,
    "scannet": write_scannet,
    "scannetpp": write_scannetpp,
    "nerfstudio": write_nerfstudio,
    "3dmatch": write_threedmatch,
    "redwood": write_redwood,
    "rtabmap": write_rtabmap,
    "arti4d": write_arti4d,
}
KINDS = ("r3d", "r3d-folder", "exr", "exr-below", *WRITERS, "7scenes-zip", "stray-zip", "polycam-zip", "3dmatch-zip")
KNOW_NO_GRAVITY = ("redwood", "arti4d")
INTERPOLATED = ("tum", "arkitscenes")


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_gives_the_same_cameras_poses_and_depth(kind, tmp_path):
    recording = open_recording(write(kind, tmp_path))
    truth = ROOM.poses()
    assert len(recording.frames) == len(truth)
    stride = recording.frames[1].index
    world = world_of(recording)
    for frame in recording.frames:
        expected = truth[frame.index // stride]
        # TUM: interpolated across the bends of a polygonal walk; the nearest pose alone would be off by 12 mm
        assert np.allclose(
            (world @ frame.capture_from_camera.matrix), expected.matrix, atol=2e-3 if kind in INTERPOLATED else 1e-6
        )
        assert np.allclose(astuple(frame.rgb_camera), astuple(ROOM.camera), atol=1e-5)
        assert np.allclose(astuple(frame.depth_camera), astuple(ROOM.camera.resized(*depth_size(kind))), atol=1e-5)
        depth = recording.depth_of(frame).metres
        exact = ROOM.depth(expected, frame.depth_camera)
        good = depth > 0
        assert good.mean() > 0.99
        assert np.abs(depth - exact)[good].max() < HALF_STEP_M


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_pairs_each_frame_with_its_upright_image(kind, tmp_path):
    recording = open_recording(write(kind, tmp_path))
    stride = recording.frames[1].index
    pictures = [ROOM.image(pose, ROOM.camera)[..., ::-1].astype(int) for pose in ROOM.poses()]
    for frame in recording.frames[::4]:
        colour = colour_pixels(recording.colour_of(frame), frame.rgb_name)
        off = [np.abs(colour - picture).mean() for picture in pictures]
        assert int(np.argmin(off)) == frame.index // stride
        assert min(off) < 6.0  # grey levels: the loss of JPEG, or of video with halved colour resolution


def depth_size(kind: str) -> tuple[int, int]:
    registered = any(kind.startswith(name) for name in ("7scenes", "tum", "3dmatch", "redwood", "arti4d"))
    return ROOM.rgb_size if registered else ROOM.depth_size


def world_of(recording: Recording) -> np.ndarray:
    """Our world (+Z up) from the recording's: the first pose is assumed to be right."""
    first = ROOM.poses()[0].matrix
    return first @ np.linalg.inv(recording.frames[0].capture_from_camera.matrix)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in KNOW_NO_GRAVITY])
def test_formats_with_gravity_provide_the_correct_up_direction(kind, tmp_path):
    recording = open_recording(write(kind, tmp_path))
    up_world = world_of(recording)[:3, :3] @ recording.up_capture
    assert np.degrees(np.arccos(np.clip(up_world[2], -1, 1))) < 0.02


def test_opengl_cameras_are_converted_to_look_along_plus_z(tmp_path):
    recording = open_recording(write_r3d(tmp_path / "scan.r3d", ROOM))
    forward = recording.frames[0].capture_from_camera.rotation[:, 2]
    assert np.allclose(forward, YUP_FROM_ZUP @ ROOM.poses()[0].rotation[:, 2], atol=1e-9)


def test_frames_are_matched_to_poses_by_number_not_by_position(tmp_path):
    recording = open_recording(write_r3d(tmp_path / "scan.r3d", ROOM, skip=(0, 3, 4)))
    assert [f.index for f in recording.frames] == [1, 2, 5, 6, 7, 8, 9, 10, 11]
    expected = YUP_FROM_ZUP @ ROOM.poses()[5].translation
    assert np.allclose(recording.frames[2].capture_from_camera.translation, expected)
    assert any("missing" in n for n in recording.notices)


def test_per_frame_calibration_is_preferred(tmp_path):
    rows = [[90.0 + k, 91.0 + k, 48.0, 62.0] for k in range(ROOM.count)]
    recording = open_recording(write_r3d(tmp_path / "scan.r3d", ROOM, perFrameIntrinsicCoeffs=rows))
    frame = recording.frames[7]
    assert (frame.rgb_camera.fx, frame.rgb_camera.fy) == (97.0, 98.0)
    assert (frame.rgb_camera.cx, frame.rgb_camera.cy) == (48.5, 62.5)  # integer pixel centres become i + 0.5
    assert frame.depth_camera.cx == pytest.approx(24.25)


def test_an_older_app_without_depth_size_and_gravity_is_read(tmp_path):
    poses = ROOM.poses()
    relative = [poses[0].inverse @ p for p in poses]
    gl = np.diag([1.0, -1.0, -1.0])
    rows = [[*Rotation.from_matrix(gl @ p.rotation @ gl).as_quat(), *(gl @ p.translation)] for p in relative]
    older = {"dw": None, "dh": None, "initPose": None, "frameTimestamps": None, "cameraType": None, "poses": rows}
    recording = open_recording(write_r3d(tmp_path / "old.r3d", ROOM, **older))
    assert recording.up_capture is None
    assert (recording.frames[0].depth_camera.width, recording.frames[0].depth_camera.height) == ROOM.depth_size
    assert recording.frames[6].timestamp_s == pytest.approx(0.1)
    moved = recording.frames[0].capture_from_camera.inverse @ recording.frames[5].capture_from_camera
    assert np.allclose(moved.matrix, (poses[0].inverse @ poses[5]).matrix, atol=1e-9)


def test_init_pose_rotates_gravity_into_the_recordings_world(tmp_path):
    turn = Rotation.from_euler("x", 40, degrees=True)
    recording = open_recording(write_r3d(tmp_path / "scan.r3d", ROOM, initPose=[*turn.as_quat(), 0, 0, 0]))
    assert np.allclose(turn.apply(recording.up_capture), [0, 1, 0])
    assert np.allclose(recording.other_ups, [[0, 1, 0], turn.apply([0, 1, 0])])  # other possible conventions


def test_images_are_not_rotated_while_initpose_is_ambiguous(tmp_path):
    turn = Rotation.from_euler("z", 90, degrees=True)
    recording = open_recording(write_r3d(tmp_path / "scan.r3d", ROOM, initPose=[*turn.as_quat(), 0, 0, 0]))
    assert (recording.frames[0].rgb_camera.width, recording.frames[0].rgb_camera.height) == ROOM.rgb_size


def test_uncompressed_depth_is_read(tmp_path):
    recording = open_recording(write_r3d(tmp_path / "raw.r3d", ROOM, raw=True))
    exact = ROOM.depth(ROOM.poses()[2], ROOM.depth_camera)
    assert np.array_equal(recording.depth_of(recording.frames[2]).metres, exact)


def test_empty_or_missing_confidence_is_none(tmp_path):
    import zipfile

    whole = write_r3d(tmp_path / "whole.r3d", ROOM, conf=None)
    with zipfile.ZipFile(whole, "a") as archive:
        archive.writestr("rgbd/0.conf", b"")
        archive.writestr("rgbd/1.conf", lzfse.compress(b""))
    recording = open_recording(whole)
    assert [recording.depth_of(f).confidence for f in recording.frames[:3]] == [None, None, None]


def test_the_real_repacked_r3d_equals_its_exr_export(real):
    exr = open_recording(real("record3d-exr-door-handle"))
    r3d = open_recording(real("record3d-exr-door-handle/derived/door-handle-repacked.r3d"))
    assert len(exr.frames) == 56
    assert exr.frames[10].index == 66  # frame 60 is missing
    assert len(r3d.frames) == 28
    shared = 0
    for frame in r3d.frames[::9]:
        depth = r3d.depth_of(frame).metres
        twin = min(exr.frames, key=lambda f: np.abs(f.capture_from_camera.matrix - frame.capture_from_camera.matrix).max())
        assert np.allclose(twin.capture_from_camera.matrix, frame.capture_from_camera.matrix, atol=1e-12)
        assert twin.rgb_camera == frame.rgb_camera
        assert np.array_equal(exr.depth_of(twin).metres, depth)
        shared += 1
    assert shared == 4


def test_poses_with_unrelated_clocks_are_matched_by_line_with_a_notice(real):
    recording = open_recording(real("cabinet-tum-fr3-58"))
    assert len(recording.frames) == 58
    assert any("by line" in n for n in recording.notices)
    assert recording.frames[0].rgb_camera.cx == pytest.approx(320.6)


def test_a_frame_without_a_finite_pose_is_skipped(tmp_path):
    folder = write_seven_scenes(tmp_path / "k", ROOM)
    (folder / "pose" / "000015.txt").write_text("\n".join(["-inf -inf -inf -inf"] * 4))
    recording = open_recording(folder)
    assert 15 not in [f.index for f in recording.frames]
    assert any("pose" in n for n in recording.notices)


def test_more_frames_than_poses_is_an_error(tmp_path):
    rows = arkit_rows(ROOM.poses())[:6]
    with pytest.raises(CaptureError, match="12 frames up to number 11, but 6 poses"):
        open_recording(write_r3d(tmp_path / "scan.r3d", ROOM, poses=rows))


@pytest.mark.parametrize(("depth_size", "raw"), [((480, 640), False), ((720, 960), True), ((192, 256), False)])
def test_missing_face_id_and_lidar_depth_sizes_are_inferred(depth_size, raw, tmp_path):
    room = replace(ROOM, count=1, rgb_size=(720, 960), depth_size=depth_size, focal=690.0)
    missing = {"dw": None, "dh": None, "frameTimestamps": None, "initPose": None, "cameraType": None}
    recording = open_recording(write_r3d(tmp_path / "scan.r3d", room, raw=raw, conf=None, **missing))
    frame = recording.frames[0]
    depth = recording.depth_of(frame)
    assert (frame.depth_camera.width, frame.depth_camera.height, depth.confidence) == (*depth_size, None)
    assert np.abs(depth.metres - room.depth(room.poses()[0], room.depth_camera)).max() < 1e-6


def test_calibration_is_scaled_to_images_larger_than_the_metadata_size(tmp_path):
    half = ROOM.camera.resized(48, 64)
    matrix = [half.fx, 0, 0, 0, half.fy, 0, half.cx - 0.5, half.cy - 0.5, 1]
    recording = open_recording(write_r3d(tmp_path / "scan.r3d", ROOM, w=48, h=64, K=matrix))
    assert recording.frames[3].rgb_camera == ROOM.camera


def test_incomplete_per_frame_calibration_falls_back_to_the_shared_one(tmp_path):
    for rows in ([], [[90.0, 91.0, 48.0, 62.0]]):
        recording = open_recording(write_r3d(tmp_path / "scan.r3d", ROOM, perFrameIntrinsicCoeffs=rows))
        assert recording.frames[7].rgb_camera == ROOM.camera
