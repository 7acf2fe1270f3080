"""Arti4D (CoRL 2025), raw: rgb/*.jpg, depth/*.png in mm, rgb|depth/camera_info.txt, odom/SEQUENCE.csv, and *tf*.json too.

The layout is that of the authors' own loader (robot-learning-freiburg/artipoint, dataloader/arti4d.py): file names end in
_<nanoseconds>, poses are of the tracked base in seconds, and a camera's is base * base_T_depth * depth_T_rgb. Depth is
registered to colour. Some scenes were filmed with the camera upside down and their images turned back: that loader takes a
flag for this; here it is detected from poses in which the images' up points down. Pixel centres lie at integers.
"""

import re
from typing import Any

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_recording
from r2c2r_core.ingest.readers.images import first_size
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.stored_depth import depth_size
from r2c2r_core.ingest.readers.texts import camera_of, pose_of_quaternion, read_json_object, read_numbers, read_table
from r2c2r_core.ingest.readers.trajectory import Trajectory, named_at

_COLOUR, _DEPTH = r"rgb/(?:[^/]*_)?(\d{11,}|\d+\.\d+)\.(?i:jpe?g)", r"depth/(?:[^/]*_)?(\d{11,}|\d+\.\d+)\.(?i:png)"
_ODOMETRY, _CALIBRATION = r"odom/[^/]+\.csv", r"[^/]*tf[^/]*\.json"
_APART_S, _GAP_S = 0.05, 0.1  # a Kinect's frames are 33 ms apart, and its trackers' poses closer
_COLUMNS = ("timestamp", "x", "y", "z", "qx", "qy", "qz", "qw")
_TURNED_BACK = Rigid3(np.diag([-1.0, -1.0, 1.0]), np.zeros(3))
_HANGS = -0.5  # mean component of the images' up along the world's: below, they are upside down


def open_arti4d(files: Files) -> Recording:
    """One raw sequence of Arti4D; raises CaptureError."""
    colour, depth = _stamped(files, _COLOUR), _stamped(files, _DEPTH)
    if not colour or not depth:
        raise CaptureError(f"{files.source}: no image in rgb/ or depth/ is named by its time", hint="copy the sequence again")
    times = dict(enumerate(sorted(colour)))
    odometry = next(name for name in sorted(files.names()) if re.fullmatch(_ODOMETRY, name))
    calibration = _calibration_name(files)
    trajectory, base_from_camera = _trajectory(files, odometry), _base_from_camera(files, calibration)
    based = {n: trajectory.at(t, apart_s=_APART_S, gap_s=_GAP_S) for n, t in times.items()}
    poses = {n: pose @ base_from_camera for n, pose in based.items() if pose is not None}
    hangs = _hangs(list(poses.values()))
    if hangs:
        poses = {n: pose @ _TURNED_BACK for n, pose in poses.items()}
    found = Found(
        colour={n: colour[t] for n, t in times.items()},
        depth=named_at(times, depth, _APART_S),
        poses=poses,
        times_s=times,
    )
    rgb_camera = _camera(files, "rgb/camera_info.txt", first_size(files, found.colour.values()))
    depth_camera = _camera(files, "depth/camera_info.txt", depth_size(files, found.depth.values()))
    turned = ("the poses show the camera upside down: its images are assumed to be turned back by 180°",) if hangs else ()
    return joined_recording(
        files,
        found,
        lambda _: rgb_camera,
        lambda _: depth_camera,
        format="Arti4D",
        notices=turned,
        other_names=("rgb/camera_info.txt", "depth/camera_info.txt", odometry, calibration),
    )


def _stamped(files: Files, pattern: str) -> dict[float, str]:
    """Files by time, seconds."""
    matches = ((re.fullmatch(pattern, name), name) for name in files.names())
    return {_seconds(match.group(1)): name for match, name in matches if match}


def _seconds(stamp: str) -> float:
    """Seconds of a time stamp: its first ten digits are whole Unix seconds (until the year 2286), the rest decimals."""
    return float(stamp) if "." in stamp else float(f"{stamp[:10]}.{stamp[10:]}")


def _calibration_name(files: Files) -> str:
    names = sorted(name for name in files.names() if re.fullmatch(_CALIBRATION, name))
    if not names:
        raise CaptureError(
            f"{files.source}: no calibration between tracker and camera (*tf*.json)",
            hint="copy meta/calibration/azure_tf.json of the data set beside rgb/",
        )
    return names[0]


def _trajectory(files: Files, name: str) -> Trajectory:
    """The tracked base's poses by time."""
    timed = []
    for row in read_table(files, name, _COLUMNS):
        time_s, *numbers = (row[column] for column in _COLUMNS)
        if np.isfinite(time_s) and (pose := pose_of_quaternion(np.array(numbers))) is not None:
            timed.append((time_s, pose))
    if not timed:
        raise CaptureError(f"{files.source}/{name}: no line of {','.join(_COLUMNS)}", hint="check the odometry file")
    timed.sort(key=lambda each: each[0])
    return Trajectory(np.array([time_s for time_s, _ in timed]), [pose for _, pose in timed])


def _base_from_camera(files: Files, name: str) -> Rigid3:
    document = read_json_object(files, name)
    return _transform(document, "base_T_depth", files, name) @ _transform(document, "depth_T_rgb", files, name)


def _transform(document: dict[str, Any], key: str, files: Files, name: str) -> Rigid3:
    """One transform of the calibration: translation {x, y, z}, rotation {x, y, z, w}."""
    try:
        entry = document[key]
        numbers = [entry["translation"][axis] for axis in "xyz"] + [entry["rotation"][axis] for axis in "xyzw"]
        pose = pose_of_quaternion(np.array(numbers, dtype=np.float64))
    except (KeyError, TypeError, ValueError):
        pose = None
    if pose is None:
        raise CaptureError(
            f"{files.source}/{name}: {key} is not a transform", hint="expected translation {x, y, z} and rotation {x, y, z, w}"
        )
    return pose


def _hangs(poses: list[Rigid3]) -> bool:
    """Whether the images' up points down, in a world whose +Z is up."""
    return bool(poses) and float(np.mean([-pose.rotation[2, 1] for pose in poses])) < _HANGS


def _camera(files: Files, name: str, size: tuple[int, int]) -> Intrinsics:
    """The camera of ROS's CameraInfo printed as text: a line `K: (fx, 0, cx, 0, fy, cy, 0, 0, 1)`."""
    match = re.search(r"^\s*K\s*:\s*[\[(]([^\])]*)[\])]", files.read(name).decode("utf-8", errors="replace"), re.MULTILINE)
    camera = None if match is None else camera_of(read_numbers(match.group(1).encode()), size)
    if camera is None:
        raise CaptureError(
            f"{files.source}/{name}: no line K of nine numbers", hint="expected K: (fx, 0, cx, 0, fy, cy, 0, 0, 1)"
        )
    return camera


READER = Reader(
    name="Arti4D",
    parts=(
        Part("rgb/NAME_TIME.jpg", _COLOUR),
        Part("depth/NAME_TIME.png", _DEPTH),
        Part("rgb/camera_info.txt", r"rgb/camera_info\.txt"),
        Part("depth/camera_info.txt", r"depth/camera_info\.txt"),
        Part("odom/SEQUENCE.csv", _ODOMETRY),
    ),
    open=open_arti4d,
)
