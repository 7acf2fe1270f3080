"""RTAB-Map (phone app or ROS): colour, depth, calibrations and poses as `rtabmap-export --images --poses_camera` writes them.

NAME_rgb/N.jpg, NAME_depth/N.png and NAME_calib/N.yaml, where N is the node's number (`--images_id`) or its time.
NAME_camera_poses.txt holds `time x y z qx qy qz qw number` a line: camera-to-world with OpenCV axes, in a world with z up.
NAME_poses.txt (`--poses`) is of the device, on which the camera stands as local_transform of its calibration says. Depth is
uint16 millimetres, often smaller than the picture; pixel centres lie at integers. (introlab/rtabmap, tools/Export/main.cpp.)
"""

import re
from functools import partial
from pathlib import PurePosixPath
from typing import NamedTuple

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_frames
from r2c2r_core.ingest.readers.images import MOST_FRAMES, colour_file, depth_file, first_size
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import integer_centred, lines_of, pose_of_matrix, pose_of_quaternion, read_numbers

_NODE = r"\d+(?:\.\d+)?"
_COLOUR, _DEPTH, _CALIBRATION = (
    rf"[^/]+_{kind}/{_NODE}\.(?i:{ending})" for kind, ending in (("rgb", "jpe?g"), ("depth", "png"), ("calib", "ya?ml"))
)
_OF_CAMERA, _OF_DEVICE = r"[^/]+_camera_poses\.txt", r"[^/]+(?<!_camera)(?<!_scan)_poses\.txt"
_SAME_S = 1e-4  # a file's name has six digits of its time
_NO_LENS = 1e-6


class _Node(NamedTuple):
    time_s: float
    pose: Rigid3 | None  # as the file has it: of the camera or of the device


class _Calibration(NamedTuple):
    camera: Intrinsics
    device_from_camera: Rigid3 | None
    distorted: bool


def open_rtabmap(files: Files) -> Recording:
    """The recording in a folder of rtabmap-export; raises CaptureError."""
    name = min(n for n in files.names() if re.fullmatch(f"{_OF_CAMERA}|{_OF_DEVICE}", n))
    of_camera = re.fullmatch(_OF_CAMERA, name) is not None
    nodes = _nodes(files, name)
    colour, depth, calibrations = (_by_node(files, pattern, nodes) for pattern in (_COLOUR, _DEPTH, _CALIBRATION))
    read = {number: _calibration(files, path) for number, path in calibrations.items()}
    if not read:
        raise CaptureError(f"{files.source}: no calibration of a node of {name}", hint="export images and poses together")
    size, depth_size = first_size(files, colour.values(), "colour image"), first_size(files, depth.values(), "depth image")
    common = read[min(read)]
    cameras = {number: read.get(number, common).camera.resized(*size) for number in nodes}
    poses = {
        number: node.pose if of_camera else _of_camera(node.pose, read.get(number, common)) for number, node in nodes.items()
    }
    found = Found(colour=colour, depth=depth, poses=poses, times_s={number: node.time_s for number, node in nodes.items()})
    frames, notices = joined_frames(files, found, cameras.__getitem__, lambda n: cameras[n].resized(*depth_size))
    if any(one.distorted for one in read.values()):
        notices.append("the calibration has lens distortion, which is not corrected: export rectified images")
    return Recording(
        format="RTAB-Map export",
        files=files,
        frames=frames,
        colour_of=partial(colour_file, files),
        depth_of=partial(depth_file, files, 1000.0),
        up_capture=np.array([0.0, 0.0, 1.0]),
        notices=tuple(notices),
        other_names=(name, *calibrations.values()),
    )


def _nodes(files: Files, name: str) -> dict[int, _Node]:
    """The rows of a pose file by node number, or by rank where they have none (format 10)."""
    nodes = {}
    for rank, line in enumerate(lines_of(files, name)):
        row = read_numbers(line.encode())
        if row is None or row.size not in (8, 9) or not np.isfinite(row[[0, -1]]).all():
            raise CaptureError(
                f"{files.source}/{name}: line '{line[:80]}', expected 'time x y z qx qy qz qw number'",
                hint="export poses in format 11, the default",
            )
        number = int(row[8]) if row.size == 9 else rank
        if 0 <= number < MOST_FRAMES:
            nodes[number] = _Node(float(row[0]), pose_of_quaternion(row[1:8]))
    return nodes


def _by_node(files: Files, pattern: str, nodes: dict[int, _Node]) -> dict[int, str]:
    """Files by the node in their name: its number, else its time."""
    found, times = {}, np.array([node.time_s for node in nodes.values()])
    for name in files.names():
        if not re.fullmatch(pattern, name):
            continue
        stem = PurePosixPath(name).stem
        if "." not in stem and int(stem) in nodes:
            found[int(stem)] = name
        elif len(times) and abs(times - float(stem)).min() < _SAME_S:
            found[list(nodes)[int(abs(times - float(stem)).argmin())]] = name
    return found


def _calibration(files: Files, name: str) -> _Calibration:
    text = files.read(name).decode("utf-8", errors="replace")
    matrix, size = _data(text, "camera_matrix", 9), [_whole(text, key) for key in ("image_width", "image_height")]
    if matrix is None or min(matrix[0], matrix[4]) <= 0 or min(size) <= 0:
        raise CaptureError(
            f"{files.source}/{name}: expected camera_matrix with 9 numbers, image_width and image_height",
            hint="export it again",
        )
    local, lens = _data(text, "local_transform", 12), _data(text, "distortion_coefficients", None)
    return _Calibration(
        camera=integer_centred(matrix[0], matrix[4], matrix[2], matrix[5], (size[0], size[1])),
        device_from_camera=None if local is None else pose_of_matrix(local.reshape(3, 4)),
        distorted=lens is not None and bool(np.abs(lens).max(initial=0.0) > _NO_LENS),
    )


def _of_camera(device: Rigid3 | None, calibration: _Calibration) -> Rigid3 | None:
    mounted = calibration.device_from_camera
    return None if device is None or mounted is None else device @ mounted


def _data(text: str, key: str, count: int | None) -> np.ndarray | None:
    """The numbers under `data:` of a matrix in OpenCV's YAML."""
    found = re.search(rf"^{key}:.*?data:\s*\[([^\]]*)\]", text, re.MULTILINE | re.DOTALL)
    numbers = None if found is None else read_numbers(found.group(1).encode())
    return None if numbers is None or not np.isfinite(numbers).all() or count not in (None, numbers.size) else numbers


def _whole(text: str, key: str) -> int:
    found = re.search(rf"^{key}:\s*(\d{{1,6}})\s*$", text, re.MULTILINE)
    return int(found.group(1)) if found else 0


READER = Reader(
    name="RTAB-Map export",
    parts=(
        Part("NAME_rgb/N.jpg", _COLOUR),
        Part("NAME_depth/N.png", _DEPTH),
        Part("NAME_calib/N.yaml", _CALIBRATION),
        Part("NAME_camera_poses.txt", f"{_OF_CAMERA}|{_OF_DEVICE}"),
    ),
    open=open_rtabmap,
)
