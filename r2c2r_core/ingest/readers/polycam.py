"""Polycam's raw export: keyframes/{images,cameras,depth,confidence}/<microseconds>.{jpg,json,png,png}.

corrected_images and corrected_cameras (undistorted) are preferred where they exist; large scans have none. Camera files hold
fx, fy, cx, cy, width, height and t_00..t_23, row-major camera-to-world with ARKit's axes in a y-up world; since 2025 corrected
ones have no width and height, which are those of the image. Depth is uint16 millimetres, confidence 0, 127 or 255. Frames are
named by their time; their number here is its rank. (PolyCam/polyform; nerfstudio pull request 3725.)
"""

from collections.abc import Iterable
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

_IMAGES, _CAMERAS = r"images/(\d+)\.(?i:jpe?g|png)", r"cameras/(\d+)\.json"
_DEPTH, _CONFIDENCE = r"keyframes/depth/(\d+)\.(?i:png)", r"keyframes/confidence/(\d+)\.(?i:png)"
_CONFIDENCE_LEVELS = (64, 192)  # between 0, 127 and 255


def open_polycam(files: Files) -> Recording:
    """The recording in a Polycam raw export; raises CaptureError."""
    names = files.names()
    corrected = all(_by_time(names, f"keyframes/corrected_{kind}") for kind in (_IMAGES, _CAMERAS))
    kind = "keyframes/corrected_" if corrected else "keyframes/"
    by_time = [_by_time(names, pattern) for pattern in (kind + _IMAGES, kind + _CAMERAS, _DEPTH, _CONFIDENCE)]
    ranks = {time_us: rank for rank, time_us in enumerate(sorted(set().union(*by_time)))}
    colour, cameras, depth, confidence = ({ranks[t]: name for t, name in held.items()} for held in by_time)
    documents = {number: read_json_object(files, name) for number, name in cameras.items()}
    size = first_size(files, colour.values(), "colour image")
    depth_size = first_size(files, depth.values(), "depth image")
    rgb_cameras = {number: camera for number, d in documents.items() if (camera := _camera(d, size)) is not None}
    found = Found(
        colour=colour,
        depth=depth,
        poses={number: _pose(documents[number]) if number in rgb_cameras else None for number in documents},
        confidence=confidence,
        times_s={rank: time_us * 1e-6 for time_us, rank in ranks.items()},
    )
    frames, notices = joined_frames(files, found, rgb_cameras.__getitem__, lambda n: rgb_cameras[n].resized(*depth_size))
    return Recording(
        format="Polycam raw export",
        files=files,
        frames=frames,
        colour_of=partial(colour_file, files),
        depth_of=partial(depth_file, files, 1000.0, confidence_levels=_CONFIDENCE_LEVELS),
        up_capture=np.array([0.0, 1.0, 0.0]),
        notices=tuple(notices),
        other_names=tuple(cameras[f.index] for f in frames),
    )


def _by_time(names: Iterable[str], pattern: str) -> dict[int, str]:
    return numbered(names, pattern, below=10**18)  # microseconds: files are numbered by the clock, not by frame


def _camera(document: dict[str, Any], size: tuple[int, int]) -> Intrinsics | None:
    sized = {"width": size[0], "height": size[1], **document}
    numbers = _numbers(sized, ("fx", "fy", "cx", "cy", "width", "height"))
    if numbers is None or not (numbers[[0, 1, 4, 5]] >= 1).all():
        return None
    fx, fy, cx, cy, width, height = numbers
    return integer_centred(fx, fy, cx, cy, (width, height)).resized(*size)


def _pose(document: dict[str, Any]) -> Rigid3 | None:
    numbers = _numbers(document, tuple(f"t_{row}{column}" for row in range(3) for column in range(4)))
    return None if numbers is None else pose_of_matrix(numbers.reshape(3, 4), CAMERA_CV_FROM_GL)


def _numbers(document: dict[str, Any], keys: tuple[str, ...]) -> np.ndarray | None:
    return finite_numbers([document.get(key) for key in keys], (len(keys),))


READER = Reader(
    name="Polycam raw export",
    parts=(
        Part("keyframes/images/<time>.jpg", f"keyframes/(?:corrected_)?{_IMAGES}"),
        Part("keyframes/cameras/<time>.json", f"keyframes/(?:corrected_)?{_CAMERAS}"),
        Part("keyframes/depth/<time>.png", _DEPTH),
    ),
    open=open_polycam,
)
