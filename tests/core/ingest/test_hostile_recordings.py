"""Malicious recordings: limits on what a file can make the reader open, wait for, or count."""

import contextlib
import io
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import psutil
import pytest

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import FolderFiles, open_files
from r2c2r_core.ingest.readers import decoder, video
from r2c2r_core.ingest.readers.images import image_size
from r2c2r_core.ingest.readers.protocol import UnreadableFrame
from r2c2r_core.ingest.readers.table import open_recording
from tests.waiting import PATIENCE_S

from .tiny import TinyRoom, jpeg, write_r3d, write_seven_scenes, zip_folder
from .tiny_formats import HEVC, write_nerfstudio, write_stray

ROOM = TinyRoom(count=3)
CONCAT = b"ffconcat version 1.0\nfile secret.mp4\n"
SDP = b"v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\nm=video 9666 RTP/AVP 96\na=rtpmap:96 H264/90000\n"
HLS = b"#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nsecret.mp4\n#EXT-X-ENDLIST\n"


@pytest.mark.parametrize("forged", [CONCAT, SDP, HLS, b""], ids=["concat", "sdp", "hls", "empty"])
def test_a_playlist_disguised_as_mp4_is_rejected(forged: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(HEVC, tmp_path / "secret.mp4")
    monkeypatch.chdir(tmp_path)
    folder = write_stray(tmp_path / "scan", ROOM)
    (folder / "rgb.mp4").write_bytes(forged)
    with pytest.raises(CaptureError, match="an MP4 was expected"):
        open_recording(folder)


def test_ffmpeg_is_restricted_to_formats_without_external_references(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(HEVC, tmp_path / "secret.mp4")
    monkeypatch.chdir(tmp_path)
    opened = {
        content[:8]: cv2.VideoCapture(io.BufferedReader(io.BytesIO(content)), cv2.CAP_FFMPEG, []).isOpened()
        for content in (CONCAT, HEVC.read_bytes())
    }
    assert list(opened.values()) == [False, True]
    assert "format_whitelist" in os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"]
    assert decoder.OPENED is not None


def test_a_video_decoder_crash_is_isolated_and_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrong checksum makes reading fail at the end of the zip member; OpenCV then dereferences NULL and crashes."""
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    scan = zip_folder(write_stray(tmp_path / "scan", ROOM), tmp_path / "scan.zip")
    content, film = bytearray(scan.read_bytes()), HEVC.read_bytes()
    content[content.index(film) + len(film) - 10] ^= 0xFF
    scan.write_bytes(content)
    with pytest.raises(CaptureError, match=r"scan\.zip/rgb\.mp4: its decoder ended with SIG") as caught:
        open_recording(scan)
    assert "\n" not in str(caught.value)
    assert not list((tmp_path / "temporary").iterdir())


def test_a_decoder_killed_midway_raises_a_capture_error() -> None:
    before = children()
    film = video.Video(FolderFiles(HEVC.parent), HEVC.name)
    film.frame(3)
    for process in children() - before:
        process.kill()
    with pytest.raises(CaptureError, match=rf"{HEVC.name}: its decoder ended with SIGKILL"):
        film.frame(4)


def children() -> set[psutil.Process]:
    return set(psutil.Process().children(recursive=True))


def test_the_decoder_process_ends_with_its_video_and_its_parent(tmp_path: Path) -> None:
    before = children()
    film = video.Video(FolderFiles(HEVC.parent), HEVC.name)
    (ours,) = children() - before
    del film
    assert not ours.is_running()
    asking = f"""
import psutil, signal
from pathlib import Path
from r2c2r_core.ingest.files import FolderFiles, open_files
from r2c2r_core.ingest.readers.video import Video
film = Video(FolderFiles(Path({str(HEVC.parent)!r})), {HEVC.name!r})
print(psutil.Process().children()[0].pid, flush=True)
signal.raise_signal(signal.SIGKILL)
"""
    said = subprocess.run([sys.executable, "-c", asking], capture_output=True, text=True, check=False)
    assert said.returncode == -signal.SIGKILL, said.stderr
    with contextlib.suppress(psutil.NoSuchProcess):
        psutil.Process(int(said.stdout)).wait(timeout=PATIENCE_S)


def test_only_jpeg_and_png_images_are_decoded() -> None:
    picture = np.zeros((4, 5, 3), np.uint8)
    assert image_size(jpeg(picture), "a.jpg") == (5, 4)
    assert image_size(cv2.imencode(".png", picture)[1].tobytes(), "a.png") == (5, 4)
    postscript = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 5 4\n%%EndComments\n"
    for foreign in (postscript, *(cv2.imencode(suffix, picture)[1].tobytes() for suffix in (".bmp", ".tiff", ".ppm", ".webp"))):
        with pytest.raises(UnreadableFrame, match="neither a JPEG nor a PNG"):
            image_size(foreign, "a.jpg")


def test_a_named_pipe_is_rejected_as_a_recording(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "scan.r3d")
    with pytest.raises(CaptureError, match="a pipe"):
        open_recording(tmp_path / "scan.r3d")


def renamed(source: Path, target: Path, name: Callable[[str], str]) -> Path:
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for member in old.namelist():
            new.writestr(name(member), old.read(member))
    return target


@pytest.mark.parametrize("number", ["1000000000000", "9" * 250, "9" * 5000], ids=["10^12", "250 digits", "5000 digits"])
def test_an_absurdly_large_frame_number_is_ignored(number: str, tmp_path: Path) -> None:
    whole = write_r3d(tmp_path / "whole.r3d", ROOM)
    scan = renamed(whole, tmp_path / "scan.r3d", lambda name: name.replace("rgbd/2.", f"rgbd/{number}."))
    assert [frame.index for frame in open_recording(scan).frames] == [0, 1]


def test_huge_gaps_in_frame_numbers_are_counted_as_missing_frames(tmp_path: Path) -> None:
    whole = write_r3d(tmp_path / "whole.r3d", ROOM)
    scan = renamed(whole, tmp_path / "scan.r3d", lambda name: name.replace("rgbd/2.", "rgbd/9999999."))
    recording = open_recording(scan)
    assert any("9999998 of 10000000" not in notice and "missing" in notice for notice in recording.notices)


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda text: text.replace("timestamp", "frame", 1), "no column timestamp"),
        (lambda text: text + "\n" + "9" * 200_000, "field larger than field limit"),
    ],
    ids=["doubled column", "long field"],
)
def test_a_damaged_odometry_file_raises_a_clear_error(damage: Callable[[str], str], says: str, tmp_path: Path) -> None:
    folder = write_stray(tmp_path / "scan", ROOM)
    (folder / "odometry.csv").write_text(damage((folder / "odometry.csv").read_text()))
    with pytest.raises(CaptureError, match=says):
        open_recording(folder)


def test_a_duplicate_odometry_column_does_not_shift_the_others(tmp_path: Path) -> None:
    folder = write_stray(tmp_path / "scan", ROOM)
    expected = [frame.capture_from_camera.translation for frame in open_recording(folder).frames]
    lines = (folder / "odometry.csv").read_text().splitlines()
    (folder / "odometry.csv").write_text("\n".join([f"x, {lines[0]}", *(f"0, {line}" for line in lines[1:])]))
    assert np.allclose([frame.capture_from_camera.translation for frame in open_recording(folder).frames], expected)


def array_file(header: str, body: bytes = b"") -> bytes:
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + body


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x93NUMPY",
        array_file("{'descr': '<f4', 'fortran_order': False, 'shape': (64, 48), }"),
        array_file("{'descr': '|O', 'fortran_order': False, 'shape': (2, 2), }", b"\x80\x04N."),
        array_file("{'descr': '<f4', 'fortran_order': False, 'shape': (-2, -3), }", bytes(24)),
        array_file("{'descr': '<f4', 'fortran_order': False, 'shape': (9999999999, 9999999999), }"),
        array_file("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (2, 2), }", bytes(16)),
        array_file("{"),
        array_file("{'descr': '<U', 'fortran_order': 1}"),
        array_file("(" * 3000),
    ],
)
def test_an_invalid_npy_depth_array_raises_a_clear_error(content: bytes, tmp_path: Path) -> None:
    folder = write_nerfstudio(tmp_path / "scan", ROOM, npy=True)
    arrays = sorted((folder / "depths").glob("*.npy"))
    arrays[0].write_bytes(content)
    recording = open_recording(folder)  # the other frames are read
    with pytest.raises(UnreadableFrame, match="not a readable depth array"):
        recording.depth_of(recording.frames[0])
    for path in arrays:
        path.write_bytes(content)
    with pytest.raises(CaptureError, match="not a readable depth array"):
        open_recording(folder)


def test_a_zip_member_with_an_undecodable_name_raises_a_capture_error(tmp_path: Path) -> None:
    path = tmp_path / "scan.r3d"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("metadata", b"{}")
    raw = bytearray(path.read_bytes())
    raw[6:8] = (0x800).to_bytes(2, "little")  # of the local header: its name is UTF-8
    raw[30] = 0xFF
    path.write_bytes(raw)
    with pytest.raises(CaptureError, match="metadata"):
        open_files(path).read("metadata")


@pytest.mark.parametrize("down", ["0 0 0", "nan 0 0", "1e200 1e200 1"])
def test_a_gravity_vector_without_a_direction_is_rejected(down: str, tmp_path: Path) -> None:
    folder = write_seven_scenes(tmp_path / "scan", ROOM)
    (folder / "gravity-direction.txt").write_text(down)
    with pytest.raises(CaptureError, match="three numbers pointing down"), np.errstate(over="ignore"):
        open_recording(folder)
