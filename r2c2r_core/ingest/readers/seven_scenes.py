"""7-Scenes-like folders: color/N.jpg, depth/N.png, pose/N.txt, intrinsics_color.txt, gravity-direction.txt.

Depth is uint16 millimetres (0 and 65535 unknown), registered to colour; poses are 4x4 camera-to-world with OpenCV axes, their
rotations off by up to 4e-4; pixel centres lie at integers; gravity-direction.txt points down.
"""

from functools import partial

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.images import decode_depth_png, first_size, numbered
from r2c2r_core.ingest.readers.protocol import RawDepth, RawFrame, Reader, Recording

_INTRINSICS = "intrinsics_color.txt"
_GRAVITY = "gravity-direction.txt"


def open_seven_scenes(files: Files) -> Recording:
    """The recording in a 7-Scenes-like folder; raises CaptureError."""
    colour = numbered(files.names(), r"color/(?:frame-)?(\d+)(?:\.color)?\.(?:jpe?g|png)")
    depth = numbered(files.names(), r"depth/(?:frame-)?(\d+)(?:\.depth)?\.png")
    poses = numbered(files.names(), r"pose/(?:frame-)?(\d+)(?:\.pose)?\.txt")
    shared = sorted(colour.keys() & depth.keys() & poses.keys())
    if not shared:
        counts = f"{len(colour)} colour images, {len(depth)} depth images, {len(poses)} poses"
        raise CaptureError(
            f"{files.source}: {counts}, none with the same number", hint="color/N.jpg, depth/N.png and pose/N.txt share N"
        )
    rgb_camera = _camera(files, first_size(((colour[n], files.read(colour[n])) for n in shared), "colour image", files.source))
    depth_size = first_size(((depth[n], files.read(depth[n])) for n in shared), "depth image", files.source)
    depth_camera = rgb_camera.resized(*depth_size)
    frames, lost = [], []
    for number in shared:
        pose = _pose(files.read(poses[number]))
        if pose is None:
            lost.append(number)
            continue
        frames.append(
            RawFrame(
                index=number,
                timestamp_s=None,
                rgb_camera=rgb_camera,
                depth_camera=depth_camera,
                capture_from_camera=pose,
                rgb_name=colour[number],
                depth_name=depth[number],
            )
        )
    if not frames:
        raise CaptureError(f"{files.source}: none of {len(shared)} pose files holds a finite 4x4 matrix", hint="check pose/")
    notices = []
    alone = len(colour.keys() | depth.keys() | poses.keys()) - len(shared)
    if alone:
        notices.append(f"{alone} frames lack a colour image, a depth image or a pose and were left out")
    if lost:
        notices.append(f"{len(lost)} frames have no usable pose and were left out (first: {poses[lost[0]]})")
    up = _up(files)
    others = [_INTRINSICS, *(poses[f.index] for f in frames), *([_GRAVITY] if up is not None else [])]
    return Recording(
        format="7-Scenes folder",
        files=files,
        frames=tuple(frames),
        depth_of=partial(_depth_of, files),
        up_capture=up,
        notices=tuple(notices),
        other_names=tuple(others),
    )


def _camera(files: Files, size: tuple[int, int]) -> Intrinsics:
    matrix = _numbers(files.read(_INTRINSICS))
    if matrix is None or matrix.size not in (9, 16) or matrix.flat[0] <= 0:
        raise CaptureError(
            f"{files.source}/{_INTRINSICS}: expected a 3x3 calibration matrix", hint="write fx 0 cx / 0 fy cy / 0 0 1"
        )
    side = 3 if matrix.size == 9 else 4
    k = matrix.reshape(side, side)
    return Intrinsics(fx=k[0, 0], fy=k[1, 1], cx=k[0, 2] + 0.5, cy=k[1, 2] + 0.5, width=size[0], height=size[1])


def _pose(content: bytes) -> Rigid3 | None:
    matrix = _numbers(content)
    if matrix is None or matrix.size != 16 or not np.isfinite(matrix).all():
        return None  # lost tracking is written as -inf or NaN
    rotation = matrix.reshape(4, 4)[:3, :3]
    if abs(np.linalg.det(rotation) - 1.0) > 0.05:
        return None
    return Rigid3.from_matrix(matrix.reshape(4, 4))


def _up(files: Files) -> Vector3 | None:
    if _GRAVITY not in files.names():
        return None
    down = _numbers(files.read(_GRAVITY))
    if down is None or down.size != 3 or not np.isfinite(down).all() or np.linalg.norm(down) < 1e-6:
        raise CaptureError(
            f"{files.source}/{_GRAVITY}: expected three numbers pointing down", hint="correct or remove the file"
        )
    return np.asarray(-down / np.linalg.norm(down))


def _numbers(content: bytes) -> np.ndarray | None:
    try:
        return np.array([float(word) for word in content.decode().replace(",", " ").split()])
    except ValueError:  # UnicodeDecodeError is one too
        return None


def _depth_of(files: Files, frame: RawFrame) -> RawDepth:
    size = (frame.depth_camera.width, frame.depth_camera.height)
    return RawDepth(decode_depth_png(files.read(frame.depth_name), frame.depth_name, 1000.0, size), None)


def _recognise(names: frozenset[str]) -> bool:
    return _INTRINSICS in names and any(n.startswith("pose/") for n in names)


READER = Reader(
    name="7-Scenes folder",
    expects=f"color/N.jpg, depth/N.png, pose/N.txt and {_INTRINSICS}",
    recognise=_recognise,
    open=open_seven_scenes,
)
