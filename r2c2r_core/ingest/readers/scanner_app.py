"""3D Scanner App's raw export: depth_N.png, conf_N.png, frame_N.json for every frame, frame_N.jpg for some of them.

Depth is uint16 millimetres, confidence 0..2, both for the whole photo at a lower resolution. Camera files hold
`cameraPoseARFrame`, a row-major 4x4 camera-to-world with ARKit's axes in a y-up world, and `intrinsics`, row-major 3x3 at the
photo's size with pixel centres at integers: its cx and cy lie half a pixel below those of the same file's `projectionMatrix`,
which counts from the image's edge. Photos are in sensor orientation. (laanlabs/3dScannerApp_samples.)
"""

from collections.abc import Mapping
from typing import Any

from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Y_UP, Found, joined_recording
from r2c2r_core.ingest.readers.images import first_size, numbered
from r2c2r_core.ingest.readers.protocol import Part, Reader, Recording
from r2c2r_core.ingest.readers.texts import camera_of, finite_numbers, pose_of_matrix, read_json_object, tried

_PHOTO, _CAMERA = r"frame_(\d+)\.(?i:jpe?g)", r"frame_(\d+)\.json"
_DEPTH, _CONFIDENCE = r"depth_(\d+)\.(?i:png)", r"conf_(\d+)\.(?i:png)"


def open_scanner_app(files: Files) -> Recording:
    """The recording in a raw export of 3D Scanner App; raises CaptureError."""
    photos, cameras, depth, confidence = (numbered(files.names(), p) for p in (_PHOTO, _CAMERA, _DEPTH, _CONFIDENCE))
    size = first_size(files, photos.values())
    documents = {number: tried(read_json_object, files, name) or {} for number, name in cameras.items()}
    found = Found(
        colour=photos,
        depth=depth,
        poses={number: _pose(document) for number, document in documents.items()},
        confidence=confidence,
        times_s={
            number: float(t[0]) for number, d in documents.items() if (t := finite_numbers(d.get("time"), (1,))) is not None
        },
        cameras=cameras,
    )
    return joined_recording(
        files,
        found,
        lambda n: camera_of(finite_numbers(documents[n].get("intrinsics"), (9,)), size),
        format="3D Scanner App",
        up_capture=Y_UP,
    )


def _pose(document: Mapping[str, Any]) -> Rigid3 | None:
    matrix = finite_numbers(document.get("cameraPoseARFrame"), (16,))
    return None if matrix is None else pose_of_matrix(matrix.reshape(4, 4), CAMERA_CV_FROM_GL)


READER = Reader(
    name="3D Scanner App",
    parts=(Part("frame_N.jpg", _PHOTO), Part("frame_N.json", _CAMERA), Part("depth_N.png", _DEPTH)),
    open=open_scanner_app,
)
