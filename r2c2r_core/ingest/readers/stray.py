"""Stray Scanner: rgb.mp4 (HEVC, landscape, never rotated), depth/N.png, confidence/N.png, camera_matrix.csv, odometry.csv.

Depth is uint16 millimetres (older versions write depth/N.npy), confidence 0..2, both for the whole colour image at a lower
resolution. Poses are camera-to-world with OpenCV camera axes in ARKit's y-up world; newer files carry fx, fy, cx, cy per frame,
which are preferred to camera_matrix.csv (the last frame's). Columns go by name, frames by number; pixel centres lie at
integers. (StrayRobots/scanner, docs/format.md and OdometryEncoder.swift.)
"""

from dataclasses import replace

import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Y_UP, Found, joined_recording
from r2c2r_core.ingest.readers.images import MOST_FRAMES, first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.stored_depth import ENDING
from r2c2r_core.ingest.readers.texts import integer_centred, pose_of_quaternion, read_calibration, read_table
from r2c2r_core.ingest.readers.video import Video

_VIDEO, _MATRIX, _ODOMETRY = "rgb.mp4", "camera_matrix.csv", "odometry.csv"
_COLOUR, _DEPTH, _CONFIDENCE = r"rgb/(\d+)\.(?i:jpe?g|png)", rf"depth/(\d+)\.{ENDING}", r"confidence/(\d+)\.(?i:png)"
_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_CAMERA = ("fx", "fy", "cx", "cy")


def open_stray(files: Files) -> Recording:
    """The recording in a Stray Scanner folder; raises CaptureError."""
    rows = read_table(files, _ODOMETRY, ("timestamp", "frame", *_POSE))
    odometry = {int(row["frame"]): row for row in rows if 0 <= row["frame"] < MOST_FRAMES}
    depth = numbered(files.names(), _DEPTH)
    video = Video(files, _VIDEO) if _VIDEO in files.names() else None
    colour = dict.fromkeys(odometry, _VIDEO) if video else numbered(files.names(), _COLOUR)
    size = video.size if video else first_size(files, colour.values())
    common = read_calibration(files, _MATRIX, size)
    cameras = {number: _camera(row, common) for number, row in odometry.items()}
    found = Found(
        colour=colour,
        depth=depth,
        poses={n: pose_of_quaternion(np.array([row[c] for c in _POSE])) for n, row in odometry.items()},
        confidence=numbered(files.names(), _CONFIDENCE),
        times_s={n: row["timestamp"] for n, row in odometry.items()},
    )
    recording = joined_recording(
        files, found, cameras.get, format="Stray Scanner", up_capture=Y_UP, other_names=(_MATRIX, _ODOMETRY)
    )
    return replace(recording, colour_of=lambda frame: video.frame(frame.index)) if video else recording


def _camera(row: dict[str, float], common: Intrinsics) -> Intrinsics:
    fx, fy, cx, cy = (row.get(c, np.nan) for c in _CAMERA)
    if not (np.isfinite([fx, fy, cx, cy]).all() and min(fx, fy) > 0):
        return common
    return integer_centred(fx, fy, cx, cy, (common.width, common.height))


READER = Reader(
    name="Stray Scanner",
    parts=(
        Part(_VIDEO, rf"{_VIDEO}|{_COLOUR}"),
        Part("depth/N.png", _DEPTH),
        Part(_MATRIX, _MATRIX),
        Part(_ODOMETRY, _ODOMETRY),
    ),
    open=open_stray,
)
