"""RTAB-Map (phone app or ROS): colour, depth, calibrations and poses as `rtabmap-export --images --poses_camera` writes them.

NAME_rgb/N.jpg, NAME_depth/N.png and NAME_calib/N.yaml, where N is the node's number (`--images_id`) or its time.
NAME_camera_poses.txt holds `time x y z qx qy qz qw number` a line: camera-to-world with OpenCV axes, in a world with z up.
NAME_poses.txt (`--poses`) is of the device, on which the camera stands as local_transform of its calibration says. Depth is
uint16 millimetres, often smaller than the picture; pixel centres lie at integers. (introlab/rtabmap, tools/Export/main.cpp.)
"""

import re
from pathlib import PurePosixPath
from typing import NamedTuple

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Z_UP, Found, joined_recording
from r2c2r_core.ingest.readers.images import MOST_FRAMES, first_size
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import camera_of, lines_of, pose_of_matrix, pose_of_quaternion, read_numbers, tried

_NODE = r"\d+(?:\.\d+)?"
_COLOUR, _DEPTH, _CALIBRATION = (
    rf"[^/]+_{kind}/{_NODE}\.(?i:{ending})" for kind, ending in (("rgb", "jpe?g"), ("depth", "png"), ("calib", "ya?ml"))
)
_OF_CAMERA, _OF_DEVICE = r"[^/]+_camera_poses\.txt", r"[^/]+(?<!_camera)(?<!_scan)_poses\.txt"
_SAME_S = 1e-4  # a file's name has six digits of its time
_NO_LENS = 1e-6
_DISTORTED = "the calibration has lens distortion, which is not corrected: export rectified images"


class _Node(NamedTuple):
    time_s: float
    pose: Rigid3 | None  # as the file has it: of the camera or of the device


class _Calibration(NamedTuple):
    camera: Intrinsics
    device_from_camera: Rigid3 | None
    distorted: bool


def open_rtabmap(files: Files) -> Recording:
    """The recording in a folder of rtabmap-export; raises CaptureError."""
    of_device, of_camera = ([n for n in sorted(files.names()) if re.fullmatch(p, n)][:1] for p in (_OF_DEVICE, _OF_CAMERA))
    on_device, on_camera = (
        {k: v for name in names for k, v in _nodes(files, name).items()} for names in (of_device, of_camera)
    )
    nodes = {**on_device, **on_camera}
    colour, depth, calibrations = (_by_node(files, pattern, nodes) for pattern in (_COLOUR, _DEPTH, _CALIBRATION))
    read = {number: one for number, path in calibrations.items() if (one := tried(_calibration, files, path)) is not None}
    if not read:
        raise CaptureError(
            f"{files.source}: no calibration of a node of {(*of_camera, *of_device)[0]} with its camera_matrix and image size",
            hint="export images and poses together",
        )
    size = first_size(files, colour.values())
    common = read[min(read)]
    cameras = {number: read.get(number, common).camera.resized(*size) for number in nodes}
    poses = {number: _of_camera(node.pose, read.get(number, common)) for number, node in on_device.items()}
    poses.update({number: node.pose for number, node in on_camera.items()})  # preferred, node by node
    found = Found(colour=colour, depth=depth, poses=poses, times_s={number: node.time_s for number, node in nodes.items()})
    strangers = sum(re.fullmatch(_COLOUR, name) is not None for name in files.names()) - len(colour)
    unposed = f"{strangers} colour images belong to no node of {(*of_camera, *of_device)[0]} and were left out"
    distorted = any(one.distorted for one in read.values())
    return joined_recording(
        files,
        found,
        cameras.get,
        format="RTAB-Map export",
        up_capture=Z_UP,
        notices=[*([_DISTORTED] if distorted else []), *([unposed] if strangers else [])],
        other_names=(*of_camera, *of_device, *calibrations.values()),
    )


def _nodes(files: Files, name: str) -> dict[int, _Node]:
    """The rows of a pose file by node number, or by rank where they have none (format 10)."""
    nodes, lines = {}, lines_of(files, name)
    for rank, line in enumerate(lines):
        row = read_numbers(line.encode())
        if row is None or row.size not in (8, 9) or not np.isfinite(row[[0, -1]]).all():
            continue  # a damaged line costs its node
        number = int(row[8]) if row.size == 9 else rank
        if 0 <= number < MOST_FRAMES:
            nodes[number] = _Node(float(row[0]), pose_of_quaternion(row[1:8]))
    if lines and not nodes:
        raise CaptureError(
            f"{files.source}/{name}: line '{lines[0][:80]}', expected 'time x y z qx qy qz qw number'",
            hint="export poses in format 11, the default",
        )
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
    width, height = (_whole(text, key) for key in ("image_width", "image_height"))
    camera = camera_of(_data(text, "camera_matrix", 9), (width, height))
    if camera is None:
        raise CaptureError(
            f"{files.source}/{name}: expected camera_matrix with 9 numbers, image_width and image_height",
            hint="export it again",
        )
    local, lens = _data(text, "local_transform", 12), _data(text, "distortion_coefficients", None)
    return _Calibration(
        camera=camera,
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
