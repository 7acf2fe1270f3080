"""ScanNet++'s iPhone captures: rgb/frame_N.jpg, depth/frame_N.png and pose_intrinsic_imu.json, as its toolkit extracts them.

The JSON holds {"frame_N": {"timestamp", "pose", "aligned_pose", "intrinsic", ...}}: 4x4 camera-to-world with OpenCV axes and a
3x3 calibration of the colour image. `aligned_pose` is in the metric world of the laser scan, with z up; `pose` is ARKit's own
and is not read. The calibration is that of the film, also where the extracted images were made smaller. Depth is uint16
millimetres; pixel centres lie at integers. (scannetpp/scannetpp, README.md.)
"""

import re
from collections.abc import Mapping
from typing import Any

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Z_UP, Found, joined_recording
from r2c2r_core.ingest.readers.images import MOST_FRAMES, first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import camera_of, finite_numbers, pose_of_matrix, read_json_object

_COLOUR, _DEPTH = r"rgb/frame_(\d+)\.(?i:jpe?g|png)", r"depth/frame_(\d+)\.(?i:png)"
_CAMERAS = "pose_intrinsic_imu.json"
_FILM_SIZE = (1920, 1440)


def open_scannetpp(files: Files) -> Recording:
    """The recording in the `iphone` folder of a ScanNet++ scene; raises CaptureError."""
    colour, depth = numbered(files.names(), _COLOUR), numbered(files.names(), _DEPTH)
    entries = {n: entry for n, entry in _entries(files).items() if n in colour or n in depth}  # of every frame of the film
    size = first_size(files, colour.values())
    cameras = {number: camera for number, entry in entries.items() if (camera := _camera(entry, size))}
    if not cameras:
        raise CaptureError(
            f"{files.source}/{_CAMERAS}: no frame of the {len(colour)} colour images has an 'intrinsic' of 3x3 numbers",
            hint="extract the scene with ScanNet++'s toolkit again",
        )
    poses = {number: _pose(entry) for number, entry in entries.items() if entry.get("aligned_pose") is not None}
    times = {n: float(t[0]) for n in cameras if (t := finite_numbers(entries[n].get("timestamp"), (1,))) is not None}
    found = Found(colour=colour, depth=depth, poses=poses, times_s=times)
    unaligned = f"{len(entries) - len(poses)} of {len(entries)} frames have no aligned_pose in {_CAMERAS}"
    return joined_recording(
        files,
        found,
        cameras.get,
        format="ScanNet++ iPhone",
        up_capture=Z_UP,
        notices=[unaligned] if len(poses) < len(entries) else [],
        other_names=[_CAMERAS],
    )


def _entries(files: Files) -> dict[int, Mapping[str, Any]]:
    """The JSON entries of the frames, by frame number."""
    named = ((re.fullmatch(r"frame_(\d{1,8})", key), value) for key, value in read_json_object(files, _CAMERAS).items())
    numbers = ((int(match.group(1)), value) for match, value in named if match and isinstance(value, dict))
    return {number: value for number, value in numbers if number < MOST_FRAMES}


def _camera(entry: Mapping[str, Any], size: tuple[int, int]) -> Intrinsics | None:
    camera = camera_of(finite_numbers(entry.get("intrinsic"), (3, 3)), _FILM_SIZE)
    return None if camera is None else camera.resized(*size)


def _pose(entry: Mapping[str, Any]) -> Rigid3 | None:
    matrix = finite_numbers(entry.get("aligned_pose"), (4, 4))
    return None if matrix is None else pose_of_matrix(matrix)


READER = Reader(
    name="ScanNet++ iPhone",
    parts=(Part("rgb/frame_N.jpg", _COLOUR), Part("depth/frame_N.png", _DEPTH), Part(_CAMERAS, _CAMERAS)),
    open=open_scannetpp,
)
