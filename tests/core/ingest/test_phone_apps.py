"""Peculiarities of exports from phone apps: Stray Scanner, its video, Polycam, 3D Scanner App."""

import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import FolderFiles
from r2c2r_core.ingest.readers.protocol import UnreadableFrame
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.readers.video import Video

from .tiny import TinyRoom
from .tiny_formats import (
    HEVC,
    sensor_images,
    told,
    write_polycam,
    write_scanner_app,
    write_stray,
)

ROOM = TinyRoom()
SMALL = replace(ROOM, count=4)


# Stray Scanner


def test_older_stray_exports_use_the_camera_matrix_file(tmp_path):
    recording = open_recording(write_stray(tmp_path / "s", ROOM, per_frame=False))
    assert recording.frames[5].rgb_camera.fx == pytest.approx(ROOM.focal)


def test_stray_frames_without_depth_are_skipped_and_video_stays_in_sync(tmp_path):
    recording = open_recording(write_stray(tmp_path / "s", ROOM, skip=(1, 6)))
    assert [f.index for f in recording.frames] == [0, 2, 3, 4, 5, 7, 8, 9, 10, 11]
    assert told(recording, "2 of 12 frames were left out: 2 a depth image missing")
    picture = ROOM.image(ROOM.poses()[7], ROOM.camera)[..., ::-1].astype(int)
    assert np.abs(recording.colour_of(recording.frames[5]) - picture).mean() < 6.0


def test_older_stray_exports_with_npy_depth_are_read(tmp_path):
    expected = open_recording(write_stray(tmp_path / "png", SMALL))
    folder = write_stray(tmp_path / "npy", SMALL)
    for path in list((folder / "depth").iterdir()):
        np.save(path.with_suffix(".npy"), cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
        path.unlink()
    recording = open_recording(folder)
    for found, same in zip(recording.frames, expected.frames, strict=True):
        assert np.array_equal(recording.depth_of(found).metres, expected.depth_of(same).metres)
    np.save(folder / "depth" / "000002.npy", np.zeros((3, 4), np.uint16))
    with pytest.raises(UnreadableFrame, match="4x3 pixels"):
        recording.depth_of(recording.frames[2])


def test_a_stray_export_without_camera_matrix_reports_the_missing_file(tmp_path):
    (write_stray(tmp_path / "s", SMALL) / "camera_matrix.csv").unlink()
    with pytest.raises(CaptureError, match=r"looks like Stray Scanner, but camera_matrix\.csv is missing") as caught:
        open_recording(tmp_path / "s")
    assert "odometry.csv" in caught.value.hint


def test_stray_odometry_columns_are_read_by_name(tmp_path):
    folder = write_stray(tmp_path / "s", ROOM)
    expected = open_recording(folder).frames[3]
    rows = [line.split(", ") for line in (folder / "odometry.csv").read_text().split("\n")]
    (folder / "odometry.csv").write_text("\n".join(",".join(row[::-1]) for row in rows))
    frame = open_recording(folder).frames[3]
    assert frame.index == 3
    assert np.array_equal(frame.capture_from_camera.matrix, expected.capture_from_camera.matrix)
    (folder / "odometry.csv").write_text("time, x, y\n1, 2, 3")
    with pytest.raises(CaptureError, match="no column timestamp, frame"):
        open_recording(folder)


def test_the_real_odometry_and_matrix_of_a_phone_are_read(real, tmp_path):
    source = real("stray-scanner-fragments")
    folder = write_stray(tmp_path / "s", ROOM)
    (folder / "odometry.csv").write_bytes((source / "odometry.head.csv").read_bytes())
    (folder / "camera_matrix.csv").write_bytes((source / "camera_matrix.csv").read_bytes())
    (folder / "rgb.mp4").unlink()
    (folder / "rgb").mkdir()
    for k in range(7):
        image = np.zeros((1440, 1920, 3), np.uint8)
        cv2.imwrite(str(folder / "rgb" / f"{k:06d}.jpg"), image)
        depth = (source / "promptda_depth_256x192_mm.png").read_bytes()
        (folder / "depth" / f"{k:06d}.png").write_bytes(depth)
        cv2.imwrite(str(folder / "confidence" / f"{k:06d}.png"), np.full((192, 256), 2, np.uint8))
    recording = open_recording(folder)
    assert [f.index for f in recording.frames] == list(range(7))
    frame = recording.frames[6]
    assert frame.timestamp_s == pytest.approx(0.166692834)
    # held upright: the quaternion's camera has up along its -x, so three quarter turns, and x and y are swapped
    assert (frame.rgb_camera.fx, frame.rgb_camera.width, frame.rgb_camera.height) == (1597.4362, 1440, 1920)
    metres = recording.depth_of(frame).metres
    assert metres.shape == (256, 192)
    assert 1.5 < metres.min() < metres.max() < 3.6


# Film


def test_video_frames_can_be_read_in_any_order(tmp_path):
    video = Video(FolderFiles(HEVC.parent), HEVC.name)
    pictures = sensor_images(ROOM)
    for number in (8, 9, 9, 2, 11, 0):
        off = [np.abs(video.frame(number).astype(int) - picture[..., ::-1]).mean() for picture in pictures]
        assert int(np.argmin(off)) == number
    with pytest.raises(UnreadableFrame, match="after 12 frames"):
        video.frame(12)


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda c: b"", "an MP4 was expected"),
        (lambda c: c[: len(c) // 2], "not a readable video"),
        (lambda c: c.replace(b"hvc1", b"zzzz"), r"cannot decode the codec|not a readable video"),
    ],
)
def test_an_undecodable_video_raises_a_clear_error_with_its_name(change, found, tmp_path):
    folder = write_stray(tmp_path / "s", SMALL)
    (folder / "rgb.mp4").write_bytes(change(HEVC.read_bytes()))
    with pytest.raises(CaptureError, match=found) as caught:
        open_recording(folder)
    assert "rgb.mp4" in str(caught.value)


def test_a_partly_damaged_video_loses_only_frames(tmp_path):
    folder = write_stray(tmp_path / "s", ROOM)
    content = bytearray(HEVC.read_bytes())
    middle = content.index(b"mdat") + 6000
    content[middle : middle + 3000] = bytes(3000)
    (folder / "rgb.mp4").write_bytes(content)
    recording = open_recording(folder)
    for frame in recording.frames:
        try:
            assert recording.colour_of(frame).shape == (*ROOM.rgb_size[::-1], 3)
        except UnreadableFrame:
            continue


# Polycam


def test_a_polycam_photo_mode_export_is_rejected_for_missing_depth(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL)
    for name in ("depth", "confidence"):
        shutil.rmtree(folder / "keyframes" / name)
    with pytest.raises(CaptureError, match=r"looks like Polycam raw export, but keyframes/depth") as caught:
        open_recording(folder)
    assert "photo mode" in caught.value.hint


def test_polycams_confidence_has_three_levels(tmp_path):
    levels = []
    for value in (0, 127, 255):
        recording = open_recording(write_polycam(tmp_path / str(value), SMALL, confidence=value))
        levels.append(set(recording.depth_of(recording.frames[0]).confidence.ravel().tolist()))
    assert levels == [{0}, {1}, {2}]


def test_polycam_without_corrected_images_uses_the_uncorrected_images(tmp_path):
    recording = open_recording(write_polycam(tmp_path / "p", SMALL, corrected=False))
    assert recording.frames[0].rgb_camera == ROOM.camera
    assert "keyframes/images/" in recording.frames[0].rgb_name
    corrected = open_recording(write_polycam(tmp_path / "c", SMALL))
    assert "keyframes/corrected_images/" in corrected.frames[0].rgb_name
    assert corrected.frames[1].timestamp_s == pytest.approx(0.25)


def test_polycam_corrected_cameras_without_a_size_use_their_image_size(tmp_path):
    """Exports since 2025."""
    folder = write_polycam(tmp_path / "p", SMALL)
    for path in (folder / "keyframes" / "corrected_cameras").iterdir():
        camera = json.loads(path.read_text())
        del camera["width"], camera["height"]
        path.write_text(json.dumps(camera))
    recording = open_recording(folder)
    assert [frame.rgb_camera for frame in recording.frames] == [ROOM.camera] * 4
    assert all(frame.capture_from_camera is not None for frame in recording.frames)


def test_polycam_frames_are_matched_by_timestamp(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL)
    sorted((folder / "keyframes" / "depth").iterdir())[1].unlink()
    recording = open_recording(folder)
    assert [f.index for f in recording.frames] == [0, 2, 3]
    for frame in recording.frames:
        assert frame.depth_name.split("/")[-1][:-4] == frame.rgb_name.split("/")[-1][:-4]


# 3D Scanner App


def test_scanner_app_frames_without_a_photo_are_skipped_with_a_notice(tmp_path):
    recording = open_recording(write_scanner_app(tmp_path / "s", SMALL, without_photo=(0, 2)))
    assert [f.index for f in recording.frames] == [1, 3]
    assert told(recording, "2 of 4 frames were left out: 2 a colour image missing")
    assert [f.timestamp_s for f in recording.frames] == pytest.approx([0.25, 0.75])  # relative to the first frame, photo or not
    assert [set(recording.depth_of(f).confidence.ravel().tolist()) for f in recording.frames] == [{1}, {0}]


@pytest.mark.parametrize(
    "damage",
    [
        {"cameraPoseARFrame": [1.0, 2.0]},
        {"cameraPoseARFrame": "none"},
        {"intrinsics": [0] * 9},
        {"intrinsics": [10**400] * 9},
        {"intrinsics": None},
    ],
)
def test_an_invalid_scanner_app_camera_file_skips_only_its_frame(damage, tmp_path):
    folder = write_scanner_app(tmp_path / "s", SMALL)
    file = folder / "frame_00001.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | damage))
    recording = open_recording(folder)
    assert [f.index for f in recording.frames] == [0, 2, 3]
    assert told(recording, f"1 frames have no usable {'pose' if 'cameraPoseARFrame' in damage else 'camera'}")


def test_the_real_scanner_app_chair_is_read_with_matching_frame_numbers(real):
    recording = open_recording(real("3d-scanner-app-chair"))
    assert [f.index for f in recording.frames] == list(range(0, 70, 3))
    assert told(recording, "46 of 70 frames were left out: 46 a colour image missing")
    frame = recording.frames[0]
    assert frame.depth_name == "depth_00000.png"
    assert (frame.rgb_camera.width, frame.rgb_camera.height) in {(1920, 1440), (1440, 1920)}
    assert frame.rgb_camera.fx == pytest.approx(1447.654296875)
    # The same file's projection matrix, which counts from the image's edge: (1 + 0.0068009) * 1920 / 2
    assert 966.529 in (pytest.approx(c, abs=0.01) for c in (frame.rgb_camera.cx, frame.rgb_camera.cy))
    metres, confidence, _ = recording.depth_of(frame)
    assert set(np.unique(confidence)) <= {0, 1, 2}
    assert 0.2 < np.median(metres[metres > 0]) < 5
