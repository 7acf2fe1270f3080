"""nerfstudio and NeRFCapture: transforms.json with depth_file_path or depth_path; OpenGL camera-to-world, world z up.

fl_x, fl_y, cx, cy, w, h stand once or in every frame; depth is a 16-bit PNG or .npy in steps of depth_unit_scale_factor or
integer_depth_scale (default 1 mm), 0 unknown, of the colour image's view; black in mask_path means ignore. cx and cy count
from the corner of the first pixel, as ours do. k1, k2, p1, p2, k3 are taken out here. (nerfstudio,
docs/quickstart/data_conventions.md.)
"""

import posixpath
import re
from collections.abc import Mapping
from functools import partial
from typing import Any

import cv2
import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Found, joined_frames
from r2c2r_core.ingest.readers.images import colour_file, colour_pixels, depth_file, first_size
from r2c2r_core.ingest.readers.lens import Lens, undistorted
from r2c2r_core.ingest.readers.protocol import Colour, Part, RawDepth, RawFrame, Reader, Recording
from r2c2r_core.ingest.readers.texts import pose_of_matrix, read_json_object

_TRANSFORMS = "transforms.json"
_PINHOLES = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL")
_DEPTHS = ("depth_file_path", "depth_path")  # nerfstudio's; NeRFCapture's
_CAMERA, _LENS = ("fl_x", "fl_y", "cx", "cy"), ("k1", "k2", "p1", "p2", "k3")


def open_nerfstudio(files: Files) -> Recording:
    """The recording that a transforms.json describes; raises CaptureError."""
    document = read_json_object(files, _TRANSFORMS)
    entries = _entries(files, document)
    colour, masks = (_named(files, entries, key) for key in ("file_path", "mask_path"))
    depth = next((named for key in _DEPTHS if (named := _named(files, entries, key))), {})
    if not depth:
        said = sum(any(key in entry for key in _DEPTHS) for entry in entries.values())
        raise CaptureError(
            f"{files.source}/{_TRANSFORMS}: {said} of {len(entries)} frames name a depth image, none of them exists",
            hint="export with depth: each frame needs a depth_file_path",
        )
    size, depth_size = first_size(files, colour.values(), "colour image"), first_size(files, depth.values(), "depth image")
    settings = {number: {**document, **entry} for number, entry in entries.items()}
    cameras = {number: _camera(files, setting, size) for number, setting in settings.items()}
    lenses = {number: lens for number, setting in settings.items() if any(lens := _lens(setting))}
    found = Found(colour=colour, depth=depth, poses={number: _pose(entry) for number, entry in entries.items()})
    frames, notices = joined_frames(files, found, cameras.__getitem__, lambda n: cameras[n].resized(*depth_size))
    # COLMAP's world has an arbitrary orientation; a frame's colmap_im_id shows that it came from there
    upright = not any("colmap_im_id" in entry for entry in entries.values())
    return Recording(
        format="nerfstudio transforms.json",
        files=files,
        frames=frames,
        colour_of=partial(_colour_of, files, lenses),
        depth_of=partial(_depth_of, files, 1.0 / _metres_per_unit(files, document), lenses, masks),
        up_capture=np.array([0.0, 0.0, 1.0]) if upright else None,
        notices=tuple(notices),
        other_names=(_TRANSFORMS, *masks.values()),
    )


def _entries(files: Files, document: dict[str, Any]) -> dict[int, dict[str, Any]]:
    """The frames by number: the last number in their file's name if it is unique, else their rank."""
    listed = document.get("frames")
    if not isinstance(listed, list) or not all(isinstance(e, dict) and isinstance(e.get("file_path"), str) for e in listed):
        raise CaptureError(
            f"{files.source}/{_TRANSFORMS}: 'frames' should list objects with a file_path", hint="export it again"
        )
    if document.get("camera_model", "OPENCV") not in _PINHOLES:
        raise CaptureError(
            f"{files.source}/{_TRANSFORMS}: camera model {str(document['camera_model'])[:40]}, a pinhole was expected",
            hint="undistort the images to a pinhole camera first",
        )
    numbers = [int((re.findall(r"\d{1,9}", posixpath.basename(e["file_path"])) or [-1])[-1]) for e in listed]
    if -1 in numbers or len(set(numbers)) < len(numbers):
        numbers = list(range(len(listed)))
    return dict(zip(numbers, listed, strict=True))


def _named(files: Files, entries: Mapping[int, dict[str, Any]], key: str) -> dict[int, str]:
    """The existing files that the frames name under `key`; older exports omit the extension."""
    names, found = files.names(), {}
    for number, entry in entries.items():
        if isinstance(path := entry.get(key), str):
            plain = posixpath.normpath(path.replace("\\", "/"))
            if existing := [name for name in (plain, f"{plain}.png", f"{plain}.jpg") if name in names]:
                found[number] = existing[0]
    return found


def _camera(files: Files, setting: dict[str, Any], size: tuple[int, int]) -> Intrinsics:
    fallback = {"fl_y": setting.get("fl_x"), "cx": size[0] / 2, "cy": size[1] / 2, "w": size[0], "h": size[1]}
    try:
        fx, fy, cx, cy, width, height = (float({**fallback, **setting}[key]) for key in (*_CAMERA, "w", "h"))
    except (KeyError, TypeError, ValueError) as problem:
        raise CaptureError(
            f"{files.source}/{_TRANSFORMS}: fl_x, fl_y, cx, cy, w, h should be numbers ({problem})", hint="export it again"
        ) from problem
    if not (np.isfinite([fx, fy, cx, cy, width, height]).all() and min(fx, fy, width, height) >= 1):
        raise CaptureError(f"{files.source}/{_TRANSFORMS}: a focal length or a size is not positive", hint="export it again")
    return Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=int(width), height=int(height)).resized(*size)


def _lens(setting: dict[str, Any]) -> Lens:
    k1, k2, p1, p2, k3 = (float(v) if isinstance(v := setting.get(key, 0.0), int | float) else 0.0 for key in _LENS)
    return (k1, k2, p1, p2, k3)


def _pose(entry: dict[str, Any]) -> Rigid3 | None:
    try:
        matrix = np.array(entry.get("transform_matrix"), np.float64)
    except (TypeError, ValueError):
        return None
    return pose_of_matrix(matrix, CAMERA_CV_FROM_GL) if matrix.shape in ((3, 4), (4, 4)) else None


def _metres_per_unit(files: Files, document: dict[str, Any]) -> float:
    scale = document.get("depth_unit_scale_factor", document.get("integer_depth_scale", 1e-3))
    if not isinstance(scale, int | float) or not 0 < scale < 1e3:
        raise CaptureError(
            f"{files.source}/{_TRANSFORMS}: depth_unit_scale_factor {str(scale)[:40]}", hint="1e-3 is millimetres"
        )
    return float(scale)


def _colour_of(files: Files, lenses: Mapping[int, Lens], frame: RawFrame) -> Colour:
    content, lens = colour_file(files, frame), lenses.get(frame.index)
    if lens is None:
        return content
    return undistorted(colour_pixels(content, frame.rgb_name), frame.rgb_camera, lens, nearest=False)


def _depth_of(
    files: Files, units_per_metre: float, lenses: Mapping[int, Lens], masks: Mapping[int, str], frame: RawFrame
) -> RawDepth:
    metres = depth_file(files, units_per_metre, frame).metres
    if frame.index in masks:
        metres = np.where(_mask(files, masks[frame.index], metres.shape), metres, np.float32(0))
    if frame.index in lenses:
        metres = undistorted(metres, frame.depth_camera, lenses[frame.index], nearest=True)
    return RawDepth(metres, None)


def _mask(files: Files, name: str, shape: tuple[int, ...]) -> np.ndarray:
    white = colour_pixels(files.read(name), name).max(axis=2)
    return np.asarray(cv2.resize(white, shape[::-1], interpolation=cv2.INTER_NEAREST) > 0)


READER = Reader(name="nerfstudio transforms.json", parts=(Part(_TRANSFORMS, re.escape(_TRANSFORMS)),), open=open_nerfstudio)
