"""3D Scanner App's raw export: depth_N.png, conf_N.png, frame_N.json for every frame, frame_N.jpg for some of them.

Depth is uint16 millimetres, confidence 0..2, both for the whole photo at a lower resolution. Camera files hold
`cameraPoseARFrame`, a row-major 4x4 camera-to-world with ARKit's axes in a y-up world, and `intrinsics`, row-major 3x3 at the
photo's size with pixel centres at integers: its cx and cy lie half a pixel below those of the same file's `projectionMatrix`,
which counts from the image's edge. Photos are in sensor orientation. (laanlabs/3dScannerApp_samples.)
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_frames
from r2c2r_core.ingest.readers.images import colour_file, depth_file, first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import finite_numbers, integer_centred, pose_of_matrix, read_json_object

_PHOTO, _CAMERA = r"frame_(\d+)\.(?i:jpe?g)", r"frame_(\d+)\.json"
_DEPTH, _CONFIDENCE = r"depth_(\d+)\.(?i:png)", r"conf_(\d+)\.(?i:png)"


def open_scanner_app(files: Files) -> Recording:
    """The recording in a raw export of 3D Scanner App; raises CaptureError."""
    photos, cameras, depth, confidence = (numbered(files.names(), p) for p in (_PHOTO, _CAMERA, _DEPTH, _CONFIDENCE))
    size = first_size(files, photos.values(), "photo")
    depth_size = first_size(files, depth.values(), "depth image")
    documents = {number: read_json_object(files, name) for number, name in cameras.items()}
    rgb_cameras = {number: camera for number, d in documents.items() if (camera := _camera(d, size)) is not None}
    found = Found(
        colour=photos,
        depth=depth,
        poses={number: _pose(documents[number]) if number in rgb_cameras else None for number in documents},
        confidence=confidence,
        times_s={
            number: float(t[0]) for number, d in documents.items() if (t := finite_numbers(d.get("time"), (1,))) is not None
        },
    )
    frames, notices = joined_frames(files, found, rgb_cameras.__getitem__, lambda n: rgb_cameras[n].resized(*depth_size))
    return Recording(
        format="3D Scanner App",
        files=files,
        frames=frames,
        colour_of=partial(colour_file, files),
        depth_of=partial(depth_file, files, 1000.0),
        up_capture=np.array([0.0, 1.0, 0.0]),
        notices=tuple(notices),
        other_names=tuple(cameras[f.index] for f in frames),
    )


def _camera(document: Mapping[str, Any], size: tuple[int, int]) -> Intrinsics | None:
    matrix = finite_numbers(document.get("intrinsics"), (9,))
    if matrix is None or min(matrix[0], matrix[4]) < 1:
        return None
    return integer_centred(matrix[0], matrix[4], matrix[2], matrix[5], size)


def _pose(document: Mapping[str, Any]) -> Rigid3 | None:
    matrix = finite_numbers(document.get("cameraPoseARFrame"), (16,))
    return None if matrix is None else pose_of_matrix(matrix.reshape(4, 4), CAMERA_CV_FROM_GL)


READER = Reader(
    name="3D Scanner App",
    parts=(
        Part("frame_N.jpg", _PHOTO),
        Part("frame_N.json", _CAMERA),
        Part("depth_N.png", _DEPTH),
    ),
    open=open_scanner_app,
)
