"""A recording becomes a capture on disk; unreadable ones raise a clear one-line error."""

import errno
import json
import shutil
import stat
import zipfile
from dataclasses import replace
from pathlib import Path

import cv2
import lzfse
import numpy as np
import pytest

from r2c2r_core.errors import Cancelled, CaptureError, EnvironmentProblem
from r2c2r_core.ingest import store as store_module
from r2c2r_core.ingest.depth import ridges
from r2c2r_core.ingest.stage import IngestConfig, open_images, read_capture
from r2c2r_core.progress import Progress

from .tiny import TinyRoom, write_exr, write_r3d, write_seven_scenes, write_tum, zip_folder
from .tiny_formats import told, write_stray

ROOM = TinyRoom()
QUICK = IngestConfig(finest_voxel_m=0.03, coarsest_voxel_m=0.03)


def read(source: Path, tmp_path: Path, **kwargs):
    return read_capture(source, tmp_path / "store", QUICK, **kwargs)


def rewritten(source: Path, target: Path, change) -> Path:
    """Write the zip with its members passed through `change(name, content)`; None drops one."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = change(name, old.read(name))
            if content is not None:
                new.writestr(name, content)
    return target


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_r3d(tmp_path_factory.mktemp("written") / "scan.r3d", ROOM)


@pytest.fixture
def scan(written, tmp_path):
    """A copy of the scan for one test."""
    return Path(shutil.copyfile(written, tmp_path / "scan.r3d"))


@pytest.fixture(scope="module")
def once(written, tmp_path_factory):
    """The capture of the scan, read once; tests do not change its store."""
    return read_capture(written, tmp_path_factory.mktemp("once") / "store", QUICK)


def test_the_capture_is_levelled_on_the_floor_with_the_rooms_yaw(once):
    capture = once
    assert capture.name == "scan"
    assert len(capture.frames) == ROOM.count
    assert capture.room.up_source == "file"
    assert capture.room.floor_found
    truth = ROOM.poses()
    for frame in capture.frames:
        ours, expected = frame.world_from_camera, truth[frame.index]
        assert ours.translation[2] == pytest.approx(expected.translation[2], abs=0.004)
        assert np.allclose(ours.rotation[2], expected.rotation[2], atol=1e-6)
    axis = (capture.frames[0].world_from_camera.rotation @ truth[0].rotation.T)[:, 0] @ [1, 0, 0]
    assert axis == pytest.approx(1.0)  # a y-up world is tipped over without yaw
    assert np.degrees(capture.room.manhattan_yaw_rad) == pytest.approx(np.degrees(ROOM.yaw_rad), abs=1.0)
    heights = np.quantile(capture.surface.vertices_world[:, 2], (0.01, 0.99))
    assert heights[0] == pytest.approx(0.0, abs=0.02)


def test_without_gravity_in_the_file_up_is_found_from_the_floor(tmp_path):
    capture = read(write_seven_scenes(tmp_path / "kitchen", ROOM, gravity=False), tmp_path)
    assert capture.room.up_source == "floor"
    expected = ROOM.poses()[3].rotation[2]
    assert np.degrees(np.arccos(capture.frames[3].world_from_camera.rotation[2] @ expected)) < 0.3


@pytest.mark.parametrize("write", [write_exr, write_seven_scenes, write_tum])
def test_every_format_gives_the_same_surface(write, once, tmp_path):
    other = read_capture(write(tmp_path / "other", ROOM), tmp_path / "b", QUICK)
    from scipy.spatial import cKDTree

    # x and y start at each recording's own origin: compare the heights and the distance to the camera instead
    def around(c):
        eye = c.frames[0].world_from_camera
        return eye.inverse.apply(c.surface.vertices_world)

    distance = cKDTree(around(once)).query(around(other))[0]
    assert np.median(distance) < 0.02


def test_original_jpegs_are_stored_byte_identical(scan, tmp_path):
    read(scan, tmp_path)
    original = zipfile.ZipFile(scan).read("rgbd/7.jpg")
    assert (tmp_path / "store" / "rgb" / "000007.jpg").read_bytes() == original


def test_stored_images_can_be_reopened_and_are_read_only(scan, tmp_path):
    capture = read(scan, tmp_path)
    images = open_images(tmp_path / "store", capture.frames)
    depth = images.depth(5)
    exact = ROOM.depth(ROOM.poses()[5], ROOM.depth_camera)
    assert np.abs(depth.metres - exact)[depth.valid].max() < 0.00013  # an eighth of a millimetre
    assert images.rgb(5).shape == (*ROOM.rgb_size[::-1], 3)
    assert np.array_equal(images.rgb(5), capture.images.rgb(5))
    with pytest.raises(ValueError, match="read-only"):
        depth.metres[0, 0] = 1.0
    (tmp_path / "store" / "rgb" / "000005.jpg").unlink()
    with pytest.raises(CaptureError, match=r"000005\.jpg: missing"):
        open_images(tmp_path / "store", capture.frames)


def test_images_and_surface_colours_are_rgb(tmp_path):
    folder = write_seven_scenes(tmp_path / "kitchen", ROOM)
    for path in (folder / "color").iterdir():
        cv2.imwrite(str(path), np.full((*ROOM.rgb_size[::-1], 3), (20, 60, 220), np.uint8))  # OpenCV writes BGR: red
    capture = read(folder, tmp_path)
    assert (capture.images.rgb(0)[..., 0] > 200).all()
    assert np.median(capture.surface.colours, axis=0) == pytest.approx([220, 60, 20], abs=12)


def test_low_confidence_depth_is_dropped_except_on_thin_structures(tmp_path):
    def half(depth):
        confidence = np.full(depth.shape, 2)
        confidence[:, :24] = 1
        return confidence

    capture = read(write_r3d(tmp_path / "scan.r3d", ROOM, conf=half), tmp_path)
    valid = capture.images.depth(3).valid
    thin = ridges(ROOM.depth(ROOM.poses()[3], ROOM.depth_camera))
    assert not (valid & ~thin)[:, :24].any()
    assert valid[:, :24].mean() < 0.05
    assert valid[:, 30:].mean() > 0.9


def test_medium_confidence_is_used_with_a_notice_if_high_is_scarce(tmp_path):
    def mostly_medium(depth):
        confidence = np.ones(depth.shape)
        confidence[:5], confidence[-5:] = 2, 0
        return confidence

    capture = read(write_r3d(tmp_path / "scan.r3d", ROOM, conf=mostly_medium), tmp_path)
    assert any("medium confidence" in n for n in capture.notices)
    valid = capture.images.depth(3).valid
    assert valid[10:50].mean() > 0.85
    assert not valid[-5:].any()


def test_nan_depth_is_invalid(tmp_path):
    capture = read(write_r3d(tmp_path / "scan.r3d", ROOM, nan=True), tmp_path)
    depth = capture.images.depth(2)
    assert not depth.valid[:4, :4].any()
    assert np.isfinite(depth.metres).all()


def test_the_hash_depends_only_on_the_recordings_files(tmp_path):
    folder = write_exr(tmp_path / "export", ROOM)
    first = read_capture(folder, tmp_path / "a", QUICK).sha256
    (folder / "notes.txt").write_text("not part of the recording")
    assert read_capture(folder, tmp_path / "a", QUICK).sha256 == first
    (folder / "rgb" / "3.jpg").write_bytes((folder / "rgb" / "2.jpg").read_bytes())
    assert read_capture(folder, tmp_path / "a", QUICK).sha256 != first


def test_reading_twice_gives_identical_captures(once, scan, tmp_path):
    a, b = once, read_capture(scan, tmp_path / "b", QUICK)
    assert np.array_equal(a.surface.vertices_world, b.surface.vertices_world)
    assert np.array_equal(a.world_from_capture.matrix, b.world_from_capture.matrix)
    assert a.sha256 == b.sha256


def test_long_recordings_are_subsampled_and_keep_their_frame_numbers(scan, tmp_path):
    capture = read_capture(scan, tmp_path / "store", IngestConfig(most_frames=5, finest_voxel_m=0.03, coarsest_voxel_m=0.03))
    assert [f.index for f in capture.frames] == [0, 3, 6, 9]
    assert any("one in 3" in n for n in capture.notices)


def test_a_zip_of_an_export_folder_is_read_like_the_folder(tmp_path):
    folder = write_exr(tmp_path / "EXR_RGBD", ROOM)
    capture = read(zip_folder(folder, tmp_path / "export.zip", top="EXR_RGBD/"), tmp_path)
    assert capture.format == "Record3D EXR+JPG"
    assert len(capture.frames) == ROOM.count


def test_a_damaged_jpeg_in_the_middle_is_skipped_with_a_notice(scan, tmp_path):
    damaged = rewritten(scan, tmp_path / "d.r3d", lambda n, c: c[: len(c) // 2] if n == "rgbd/4.jpg" else c)
    capture = read(damaged, tmp_path)
    assert [f.index for f in capture.frames] == [0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11]
    assert any("rgbd/4.jpg" in n for n in capture.notices)


DEPTH_BOMB = 200 * lzfse.compress(bytes(2**20))[:-4] + b"bvx$"  # blocks of 1 MB: compressing 200 MB in one takes a minute


@pytest.mark.parametrize(
    ("name", "broken", "found"),
    [
        ("rgbd/{}.jpg", b"no image at all", "neither a JPEG nor a PNG"),
        ("rgbd/{}.depth", b"bvx2 garbage", "damaged LZFSE"),
        ("rgbd/{}.depth", b"\0" * 4000, "4000 bytes of float32, 48x64 needs 12288"),
        ("rgbd/{}.depth", DEPTH_BOMB, "209715200 bytes of float32, 48x64 needs 12288"),
    ],
)
def test_too_many_damaged_frames_raise_an_error_with_the_first_file(name, broken, found, scan, tmp_path):
    bad = {name.format(k) for k in (2, 3, 7, 9)}
    damaged = rewritten(scan, tmp_path / "d.r3d", lambda n, c: broken if n in bad else c)
    with pytest.raises(CaptureError, match=found) as caught:
        read(damaged, tmp_path)
    assert name.format(2) in str(caught.value)
    assert caught.value.hint


def test_a_damaged_confidence_image_costs_its_frame_no_depth(scan, tmp_path):
    bad = {f"rgbd/{k}.conf" for k in (2, 3, 7, 9)}
    capture = read(rewritten(scan, tmp_path / "d.r3d", lambda n, c: b"\1" * 100 if n in bad else c), tmp_path)
    assert [frame.index for frame in capture.frames] == list(range(12))
    assert (capture.images.depth(2).metres > 0).mean() > 0.9
    assert any("confidence of 4 of 12 frames" in n and "rgbd/2.conf: 100 bytes" in n for n in capture.notices)


def test_a_damaged_or_missing_confidence_image_of_a_folder_costs_no_frame(tmp_path):
    folder = write_stray(tmp_path / "s", replace(ROOM, count=4))
    (folder / "confidence" / "000001.png").write_bytes(b"\x89PNG no more")
    (folder / "confidence" / "000002.png").unlink()
    capture = read(folder, tmp_path)
    assert len(capture.frames) == 4
    assert told(capture, "1 of 4 frames have no confidence image")
    assert any("confidence of 1 of 4 frames" in n and "confidence/000001.png" in n for n in capture.notices)


def test_an_error_keeps_the_earlier_store_and_leaves_no_partial_files(scan, tmp_path):
    capture = read(scan, tmp_path)
    bad = rewritten(scan, tmp_path / "d.r3d", lambda n, c: b"x" if n.endswith(".jpg") and "icon" not in n else c)
    with pytest.raises(CaptureError):
        read(bad, tmp_path)
    assert open_images(tmp_path / "store", capture.frames).rgb(3).any()
    assert sorted(p.name for p in (tmp_path / "store").iterdir()) == ["depth", "rgb"]
    assert not list(tmp_path.glob("store?*"))


def test_cancelling_leaves_no_files(scan, tmp_path):
    calls = iter(range(1000))
    with pytest.raises(Cancelled):
        read(scan, tmp_path, progress=Progress(is_cancelled=lambda: next(calls) > 5))
    assert not list(tmp_path.glob("store*"))


def test_a_full_disk_raises_an_environment_problem(scan, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(store_module.Path, "write_bytes", full)
    with pytest.raises(EnvironmentProblem, match="disk is full") as caught:
        read(scan, tmp_path)
    assert caught.value.exit_code == 1


def foreign(tmp_path):
    (tmp_path / "a.r3d").write_bytes(b"%PDF-1.7 this is no zip")
    return tmp_path / "a.r3d"


def truncated(tmp_path):
    whole = write_r3d(tmp_path / "whole.r3d", ROOM).read_bytes()
    (tmp_path / "a.r3d").write_bytes(whole[: len(whole) // 2])
    return tmp_path / "a.r3d"


def other_zip(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("holiday/beach.jpg", b"x")
    return tmp_path / "a.zip"


def escaping(name):
    def write(tmp_path):
        with zipfile.ZipFile(write_r3d(tmp_path / "a.r3d", ROOM), "a") as archive:
            archive.writestr(name, b"x")
        return tmp_path / "a.r3d"

    return write


def symlink(tmp_path):
    with zipfile.ZipFile(write_r3d(tmp_path / "a.r3d", ROOM), "a") as archive:
        info = zipfile.ZipInfo("rgbd/99.jpg")
        info.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(info, "/etc/passwd")
    return tmp_path / "a.r3d"


def bomb(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.r3d", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("metadata", "{}")
        with archive.open("rgbd/0.depth", "w", force_zip64=True) as member:
            for _ in range(260):
                member.write(b"\0" * 2**20)
    return tmp_path / "a.r3d"


def no_depth(tmp_path):
    return rewritten(
        write_r3d(tmp_path / "whole.r3d", ROOM), tmp_path / "a.r3d", lambda n, c: None if n.endswith((".depth", ".conf")) else c
    )


def metadata(**changes):
    return lambda tmp_path: write_r3d(tmp_path / "a.r3d", ROOM, **changes)


def no_json(tmp_path):
    return rewritten(
        write_r3d(tmp_path / "whole.r3d", ROOM), tmp_path / "a.r3d", lambda n, c: b"\xff{" if n == "metadata" else c
    )


def rotated(tmp_path):
    def turn(name, content):
        if not name.endswith(".jpg"):
            return content
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
        return cv2.imencode(".jpg", cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE))[1].tobytes()

    return rewritten(write_r3d(tmp_path / "whole.r3d", ROOM), tmp_path / "a.r3d", turn)


def odd_depth(tmp_path):
    whole = write_r3d(tmp_path / "whole.r3d", ROOM, dw=None, dh=None, raw=True)
    return rewritten(whole, tmp_path / "a.r3d", lambda n, c: c[: 4 * 1001] if n.endswith(".depth") else c)


def without(*names):
    def write(tmp_path):
        folder = write_seven_scenes(tmp_path / "kitchen", ROOM)
        for name in names:
            for path in sorted(folder.glob(name)):
                path.unlink()
        return folder

    return write


def leaving_link(tmp_path):
    folder = write_seven_scenes(tmp_path / "kitchen", ROOM)
    (tmp_path / "outside.txt").write_text((folder / "intrinsics_color.txt").read_text())
    (folder / "intrinsics_color.txt").unlink()
    (folder / "intrinsics_color.txt").symlink_to(tmp_path / "outside.txt")
    return folder


BAD = {
    "absent": (lambda p: p / "nothing.r3d", "no such file"),
    "foreign": (foreign, "not a readable zip"),
    "truncated": (truncated, "not a readable zip"),
    "other zip": (other_zip, r"found holiday/beach\.jpg, a picture, without depth"),
    "empty folder": (lambda p: (p / "empty").mkdir() or p / "empty", "holds no file"),
    "zip slip": (escaping("../../evil"), "points outside"),
    "absolute": (escaping("/etc/evil"), "points outside"),
    "drive": (escaping("C:/evil"), "points outside"),
    "symlink": (symlink, "symbolic link"),
    "bomb": (bomb, "at most 256 MiB"),
    "no depth": (no_depth, "12 colour images but no depth"),
    "no poses": (metadata(poses=[]), "no poses"),
    "poses are no table": (metadata(poses=[[1, 2], 3]), "rows of 7 numbers"),
    "no calibration": (metadata(K=None), "'K' should hold 9 numbers, found nothing"),
    "calibration of text": (metadata(K=["a"] * 9), "'K' should hold 9 numbers"),
    "focal length 0": (metadata(K=[0.0] * 9), "focal length"),
    "no size": (metadata(w=None), "'w' should be a positive number of pixels, found nothing"),
    "no json": (no_json, "not usable JSON"),
    "rotated images": (rotated, "another shape"),
    "odd depth size": (odd_depth, "have no size of the shape"),
    "kitchen without calibration": (without("intrin*"), "looks like 7-Scenes folder, but intrinsics_color.txt is missing"),
    "kitchen without depth": (without("depth/*"), "but depth/N.png is missing"),
    "link out of the folder": (leaving_link, "link to a file outside"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_raises_a_clear_one_line_error(case, tmp_path):
    write, found = BAD[case]
    source = write(tmp_path)
    with pytest.raises(CaptureError, match=found) as caught:
        read(source, tmp_path)
    line = str(caught.value)
    assert source.name in line
    assert "\n" not in line
    assert caught.value.hint
    assert not (tmp_path / "store" / "rgb").exists()


def test_a_recording_without_frames_raises_a_clear_error(real, tmp_path):
    with pytest.raises(CaptureError, match="49 frames but no rgbd"):
        read(real("record3d-r3d-metadata-only/data.r3d"), tmp_path)


def test_a_zip_member_with_a_bad_checksum_loses_only_its_frame(scan, tmp_path):
    content = bytearray(scan.read_bytes())
    with zipfile.ZipFile(scan) as archive:
        info = archive.getinfo("rgbd/6.depth")
    start = info.header_offset + 30 + len(info.filename)
    content[start + 40] ^= 0xFF
    (tmp_path / "d.r3d").write_bytes(content)
    capture = read(tmp_path / "d.r3d", tmp_path)
    assert 6 not in [f.index for f in capture.frames]
    assert any("rgbd/6.depth" in n for n in capture.notices)


def test_metadata_with_a_wrong_type_is_an_error_not_a_crash(scan, tmp_path):
    for metadata_json in ("[]", "3", json.dumps({"w": "wide", "h": 4})):
        broken = rewritten(scan, tmp_path / "d.r3d", lambda n, c, m=metadata_json: m.encode() if n == "metadata" else c)
        with pytest.raises(CaptureError):
            read(broken, tmp_path)


def test_the_scale_option_multiplies_all_lengths_with_a_notice(once, scan, tmp_path):
    larger = read_capture(scan, tmp_path / "larger", replace(QUICK, scale=1.25))
    for one, other in zip(once.frames, larger.frames, strict=True):
        assert np.allclose(other.world_from_camera.translation, 1.25 * one.world_from_camera.translation, atol=0.01)
        assert np.allclose(other.world_from_camera.rotation, one.world_from_camera.rotation, atol=0.01)
    sizes = [np.ptp(one.surface.vertices_world, axis=0) for one in (once, larger)]
    assert sizes[1] == pytest.approx(1.25 * sizes[0], rel=0.02)  # a voxel of 3 cm is no larger
    assert "all lengths were multiplied by 1.2500, as a person measured" in larger.notices
    assert (once.scale, larger.scale) == (1.0, 1.25)
    assert not any("multiplied" in notice for notice in once.notices)
