"""Damaged and malicious recordings of every format raise CaptureError or lose frames, and cause no other error."""

import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.readers.protocol import UnreadableFrame
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.rgb import stored_jpeg

from .test_readers import WRITERS
from .tiny import TinyRoom, write_exr, write_r3d

ROOM = TinyRoom(count=3)


def r3d_folder(folder: Path, room: TinyRoom) -> Path:
    import zipfile

    zipfile.ZipFile(write_r3d(folder.with_suffix(".r3d"), room)).extractall(folder)
    return folder


FOLDERS: dict[str, Callable[[Path, TinyRoom], Path]] = {**WRITERS, "exr": write_exr, "r3d": r3d_folder}

DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "cut": lambda content: content[: len(content) // 2],
    "zeros": lambda content: bytes(len(content)),
    "noise": lambda content: np.random.default_rng(0).bytes(len(content)),
    "bracket": lambda content: b"[" * 100_000,
    "huge numbers": lambda content: b"1e308 -1e308 99999999999999999999 nan inf -inf\n" * 50,
}


@pytest.mark.parametrize("kind", FOLDERS)
def test_any_damaged_file_loses_frames_or_raises_a_capture_error(kind, tmp_path):
    folder = FOLDERS[kind](tmp_path / "made", ROOM)
    sorts = {(path.parent, path.suffix): path for path in sorted(folder.rglob("*")) if path.is_file()}
    for path in sorts.values():
        whole = path.read_bytes()
        for name, damage in DAMAGES.items():
            path.write_bytes(damage(whole))
            said = what_is_said(folder)
            assert said is None or ("\n" not in said and "; " in said), (path, name, said)
        path.write_bytes(whole)


def what_is_said(folder: Path) -> str | None:
    """The error's line with its hint; None if the recording can be read, with or without all its frames."""
    try:
        read_all(folder)
    except CaptureError as problem:
        return f"{problem.message}; {problem.hint}" if problem.hint else problem.message
    return None


def read_all(folder: Path) -> None:
    recording = open_recording(folder)
    for frame in recording.frames:
        try:
            stored_jpeg(recording.colour_of(frame), frame.rgb_name, (frame.rgb_camera.width, frame.rgb_camera.height))
            depth = recording.depth_of(frame)
        except UnreadableFrame:
            continue
        assert depth.metres.shape == (frame.depth_camera.height, frame.depth_camera.width)
        assert np.isfinite(frame.rgb_camera.matrix).all()
        if frame.capture_from_camera is not None:
            assert np.isfinite(frame.capture_from_camera.matrix).all()


@pytest.mark.parametrize("size", [(100_000, 100_000), (2**30, 2**30), (-5, 5)])
def test_an_exr_with_an_absurd_size_loses_only_its_frame(size, tmp_path):
    folder = write_exr(tmp_path / "e", replace(ROOM, count=3))
    path = folder / "depth" / "1.exr"
    content = bytearray(path.read_bytes())
    at = content.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    struct.pack_into("<4i", content, at, 0, 0, size[0] - 1, size[1] - 1)
    path.write_bytes(content)
    recording = open_recording(folder)
    with pytest.raises(UnreadableFrame, match=r"depth/1\.exr"):
        recording.depth_of(recording.frames[1])


def test_a_png_with_an_absurd_size_loses_only_its_frame(tmp_path):
    folder = WRITERS["scannet"](tmp_path / "s", ROOM)
    path = folder / "depth" / "1.png"
    content = bytearray(path.read_bytes())
    struct.pack_into(">2I", content, 16, 60_000, 60_000)
    path.write_bytes(content)
    recording = open_recording(folder)
    with pytest.raises(UnreadableFrame, match=r"depth/1\.png"):
        recording.depth_of(recording.frames[1])


@pytest.mark.parametrize(
    "changes",
    [
        {"w": -96},
        {"h": 1e30},
        {"w": True},
        {"w": 0.5},
        {"dw": -48},
        {"dh": 1e12},
        {"dw": 4800},
        {"fps": float("nan"), "K": [float("inf")] * 9},
        {"K": [1e300] * 9},
        {"poses": [[0, 0, 0, 1, 1e30, 0, 0]] * 3},
        {"poses": "no"},
    ],
)
def test_absurd_metadata_values_are_rejected(changes, tmp_path):
    scan = write_r3d(tmp_path / "a.r3d", ROOM, **changes)
    with pytest.raises((CaptureError, UnreadableFrame)):
        open_first(scan)


def open_first(scan: Path) -> None:
    recording = open_recording(scan)
    recording.depth_of(recording.frames[0])


def test_a_metadata_number_with_400_digits_is_rejected(tmp_path):
    folder = write_exr(tmp_path / "e", ROOM)
    text = (folder / "metadata.json").read_text()
    (folder / "metadata.json").write_text(text.replace('"w": 96', f'"w": {"9" * 400}'))
    with pytest.raises(CaptureError, match="'w' should be"):
        open_recording(folder)


def test_invalid_frame_timestamps_are_ignored(tmp_path):
    for k, times in enumerate(([float("nan")] * 3, ["a"], 5, [1e400, 2, 3])):
        recording = open_recording(write_r3d(tmp_path / f"{k}.r3d", ROOM, frameTimestamps=times, fps=-1))
        assert all(frame.timestamp_s is None for frame in recording.frames)
