"""Example recording format: frame_N.npz, each with rgb, depth_m, camera (3x3) and world_from_camera (4x4, OpenCV axes)."""

import io
import re
from functools import partial

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.protocol import Part, RawDepth, RawFrame, Reader, Recording, UnreadableFrame

NAME = r"frame_(\d+)\.npz"


def open_scan(files: Files) -> Recording:
    numbered = {int(match[1]): match[0] for match in (re.fullmatch(NAME, name) for name in files.names()) if match}
    return Recording(
        format=READER.name,
        files=files,
        frames=tuple(read_frame(files, index, name) for index, name in sorted(numbered.items())),
        colour_of=partial(read_colour, files),
        depth_of=partial(read_depth, files),
        up_capture=np.array([0.0, 0.0, 1.0]),
    )


def read_frame(files: Files, index: int, name: str) -> RawFrame:
    try:
        held = load(files, name)
        (fx, _, cx), (_, fy, cy), _ = held["camera"].tolist()
        height, width = held["depth_m"].shape
        pose = held["world_from_camera"]
    except (KeyError, ValueError) as problem:
        raise CaptureError(f"{files.source}/{name}: {problem}", hint="write the frame again") from problem
    camera = Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=width, height=height)  # pixel centres at i + 0.5
    return RawFrame(
        index=index,
        timestamp_s=None,
        rgb_camera=camera,
        depth_camera=camera,
        capture_from_camera=Rigid3(pose[:3, :3], pose[:3, 3]),
        rgb_name=name,
        depth_name=name,
    )


def read_colour(files: Files, frame: RawFrame) -> np.ndarray:
    return part_of(files, frame.rgb_name, "rgb")


def read_depth(files: Files, frame: RawFrame) -> RawDepth:
    return RawDepth(part_of(files, frame.depth_name, "depth_m"), None)


def part_of(files: Files, name: str, part: str) -> np.ndarray:
    try:
        return load(files, name)[part]
    except (KeyError, ValueError) as problem:  # one frame is left out, the others are read
        raise UnreadableFrame(f"{name}: {problem}") from problem


def load(files: Files, name: str) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(files.read(name)), allow_pickle=False) as held:
        return dict(held)


READER = Reader(name="NumPy frames", parts=(Part("frame_N.npz", NAME),), open=open_scan)
