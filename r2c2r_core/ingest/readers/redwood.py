"""Redwood and Open3D: color/N.jpg (or image/, rgb/), depth/N.png, trajectory.log and a camera's JSON, or one of these two.

trajectory.log holds, for each frame, a line "i j k" and a 4x4 camera-to-world matrix with OpenCV axes; depth is uint16
millimetres registered to colour, or in the unit that the camera's JSON names; without a calibration the camera is a PrimeSense
(525, 525, 319.5, 239.5); pixel centres lie at integers; nothing tells which way is up. Open3D's RGBDVideoReader.save_frames
writes the same without trajectory.log from a RealSense or Azure Kinect recording, its `depth_scale` in units a metre (an L515's
is 4000); scripts around librealsense write metres a unit.
"""

import re
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_recording
from r2c2r_core.ingest.readers.images import first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.stored_depth import ENDING
from r2c2r_core.ingest.readers.texts import (
    camera_of,
    finite_numbers,
    integer_centred,
    pose_of_matrix,
    read_json_object,
    read_numbers,
)

_NUMBER = r"[^/\d]*(\d{1,8})(?:-\d+)?"  # ZED's tools write left000007.png beside depth000007.png
_COLOUR, _DEPTH = rf"(?:color|image|rgb)/{_NUMBER}\.(?i:jpe?g|png)", rf"depth/{_NUMBER}\.{ENDING}"
_LOG = r"(?:scene/)?trajectory\.log"
_ROW = 3 + 16  # numbers of one frame
_MILLIMETRES = 1000.0  # units a metre
_FINEST = (1e2, 1e6)  # units a metre that a uint16 depth image may be in: 655 m to 65 mm at most


class _Calibration(NamedTuple):
    camera: Intrinsics
    units_per_metre: float
    name: str | None  # of its file; None: assumed


def open_redwood(files: Files) -> Recording:
    """The recording in a Redwood or Open3D folder; raises CaptureError."""
    colour, depth = numbered(files.names(), _COLOUR), numbered(files.names(), _DEPTH)
    log = next((name for name in sorted(files.names(), key=len) if re.fullmatch(_LOG, name)), None)
    poses = _poses(files, log) if log else {}
    notices = []
    if _starts_one_earlier(poses, colour.keys()):
        poses = {number + 1: pose for number, pose in poses.items()}
        notices.append(f"images are numbered from 1, {log} from 0: pose i belongs to image i + 1")
    calibration = _calibration(files, first_size(files, colour.values()))
    if calibration.name is None:
        notices.append(
            "no calibration was found (fx, fy, cx, cy or intrinsic_matrix in a .json): a PrimeSense's 525 px is assumed"
        )
    if calibration.units_per_metre != _MILLIMETRES:
        notices.append(f"depth is read in steps of {1000 / calibration.units_per_metre:g} mm, as {calibration.name} says")
    found = Found(colour=colour, depth=depth, poses=poses)
    return joined_recording(
        files,
        found,
        lambda _: calibration.camera,
        format="Redwood / Open3D",
        notices=notices,
        other_names=[name for name in (log, calibration.name) if name],
        units_per_metre=calibration.units_per_metre,
    )


def _poses(files: Files, log: str) -> dict[int, Rigid3 | None]:
    numbers = read_numbers(files.read(log))
    if numbers is None or not numbers.size or numbers.size % _ROW:
        found = "words that are not numbers" if numbers is None else f"{numbers.size} numbers"
        raise CaptureError(f"{files.source}/{log}: {found}, {_ROW} a frame were expected", hint="copy the recording again")
    rows = numbers.reshape(-1, _ROW)
    return {int(row[0]): pose_of_matrix(row[3:].reshape(4, 4)) for row in rows if np.isfinite(row[0])}


def _starts_one_earlier(poses: Collection[int], images: Collection[int]) -> bool:
    """Whether images are numbered from 1 and poses from 0, so that pose i belongs to image i + 1."""
    return bool(images and poses) and min(poses) == 0 and min(images) == 1 and max(poses) + 1 <= max(images)


def _calibration(files: Files, size: tuple[int, int]) -> _Calibration:
    """Calibration from the first JSON that holds one, else a PrimeSense's; of the images' size where it names none."""
    for name in sorted(n for n in files.names() if "/" not in n and n.endswith(".json")):
        document = read_json_object(files, name)
        said = finite_numbers([document.get(key) for key in ("width", "height")], (2,))
        if (camera := camera_of(_matrix(document), size if said is None else (int(said[0]), int(said[1])))) is not None:
            return _Calibration(camera.resized(*size), _units_per_metre(document), name)
    assumed = integer_centred(525.0, 525.0, 319.5, 239.5, (640, 480)).resized(*size)
    return _Calibration(assumed, _MILLIMETRES, None)


def _matrix(document: Mapping[str, Any]) -> np.ndarray | None:
    """The matrix in Open3D's column-major form or by rows as ROS writes it, or of fx, fy, cx, cy by name."""
    for key in ("intrinsic_matrix", "K", "k", "camera_matrix"):
        listed, rows = (finite_numbers(document.get(key), shape) for shape in ((9,), (3, 3)))
        if (matrix := rows if listed is None else listed.reshape(3, 3)) is not None:
            return matrix if matrix[0, 2] else matrix.T
    four = finite_numbers([document.get(key) for key in ("fx", "fy", "cx", "cy")], (4,))
    return None if four is None else np.array([four[0], 0, four[2], 0, four[1], four[3], 0, 0, 1])


def _units_per_metre(document: Mapping[str, Any]) -> float:
    """Depth units per metre from `depth_scale`, given in units per metre or metres per unit; millimetres by default."""
    said = document.get("depth_scale")
    if not isinstance(said, int | float) or not said > 0:
        return _MILLIMETRES
    found = (units for units in (float(said), 1.0 / said) if _FINEST[0] <= units <= _FINEST[1])
    return round(next(found, _MILLIMETRES), 3)  # a depth scale of float32


READER = Reader(
    name="Redwood / Open3D",
    parts=(
        Part("color/N.jpg", _COLOUR),
        Part("depth/N.png", _DEPTH),
        Part("trajectory.log or a camera's .json", rf"{_LOG}|[^/]+\.json"),
    ),
    open=open_redwood,
)
