"""nerfstudio and NeRFCapture: transforms.json with depth_file_path or depth_path; OpenGL camera-to-world, world z up.

fl_x, fl_y, cx, cy, w, h stand once or in every frame; instant-ngp and Blender give the field of view instead, camera_angle_x
and camera_angle_y, and may split the file (transforms_train.json). Depth is in steps of depth_unit_scale_factor or
integer_depth_scale (default 1 mm), 0 unknown, of the colour image's view; black in mask_path means ignore. cx and cy count
from the corner of the first pixel, as ours do. k1, k2, p1, p2, k3 are taken out here. (nerfstudio,
docs/quickstart/data_conventions.md.)
"""

import posixpath
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import cv2
import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.frames import Z_UP, Found, joined_recording
from r2c2r_core.ingest.readers.images import colour_file, colour_pixels, first_size
from r2c2r_core.ingest.readers.lens import Lens, undistorted
from r2c2r_core.ingest.readers.protocol import Colour, Part, RawDepth, RawFrame, Reader, Recording
from r2c2r_core.ingest.readers.texts import finite_numbers, pose_of_matrix, read_json_object

_WHOLE = "transforms.json"
_TRANSFORMS = r"transforms(?:_train|_val|_test)?\.json"  # instant-ngp's and Blender's add-ons split it
_PINHOLES = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL")
_DEPTHS = ("depth_file_path", "depth_path")  # nerfstudio's; NeRFCapture's
_CAMERA = ("fl_x", "fl_y", "camera_angle_x", "camera_angle_y", "cx", "cy", "w", "h")
_LENS = ("k1", "k2", "p1", "p2", "k3")


def open_nerfstudio(files: Files) -> Recording:
    """The recording that a transforms.json describes; raises CaptureError."""
    names = [_WHOLE] if _WHOLE in files.names() else sorted(n for n in files.names() if re.fullmatch(_TRANSFORMS, n))
    documents = [read_json_object(files, name) for name in names]
    document, entries = documents[0], _entries(files, documents)
    colour, masks, *depths = (_named(files, entries, key) for key in ("file_path", "mask_path", *_DEPTHS))
    depth = {number: name for named in depths[::-1] for number, name in named.items()}  # the first is preferred, frame by frame
    if not depth:
        said = sum(any(key in entry for key in _DEPTHS) for entry in entries.values())
        raise CaptureError(
            f"{files.source}/{names[0]}: {said} of {len(entries)} frames name a depth image, none of them exists",
            hint="each frame needs a depth_file_path, from the folder of this file",
        )
    size = first_size(files, colour.values())
    settings = {n: {**document, **{key: v for key, v in entry.items() if v is not None}} for n, entry in entries.items()}
    cameras = {n: camera for n, setting in settings.items() if (camera := _camera(setting, size)) is not None}
    if not cameras:
        raise CaptureError(
            f"{files.source}/{names[0]}: neither fl_x nor camera_angle_x is a positive number, for the file or a frame",
            hint="give fl_x and fl_y in pixels of w x h, or camera_angle_x in radians",
        )
    lenses = {number: lens for number, setting in settings.items() if any(lens := _lens(setting))}
    found = Found(colour=colour, depth=depth, poses={number: _pose(entry) for number, entry in entries.items()})
    # COLMAP's world has an arbitrary orientation; a frame's colmap_im_id shows that it came from there
    upright = not any("colmap_im_id" in entry for entry in entries.values())
    recording = joined_recording(
        files,
        found,
        cameras.get,
        format="nerfstudio transforms.json",
        up_capture=Z_UP if upright else None,
        other_names=(*names, *masks.values()),
        units_per_metre=1.0 / _metres_per_unit(files, document),
    )
    depth_of = partial(_depth_of, files, recording.depth_of, lenses, masks)
    return replace(recording, colour_of=partial(_colour_of, files, lenses), depth_of=depth_of)


def _entries(files: Files, documents: list[dict[str, Any]]) -> dict[int, dict[str, Any]]:
    """The frames by number: the last number in their file's name if it is unique, else their rank."""
    listed: list[Any] = []
    for document in documents:
        frames = document.get("frames")
        listed += frames if isinstance(frames, list) else [None]
    if not all(isinstance(e, dict) and isinstance(e.get("file_path"), str) for e in listed):
        raise CaptureError(
            f"{files.source}/{_WHOLE}: 'frames' should list objects with a file_path",
            hint="docs.nerf.studio, Data conventions, describes the file",
        )
    model = "OPENCV_FISHEYE" if documents[0].get("is_fisheye") else documents[0].get("camera_model", "OPENCV")
    if model not in _PINHOLES:
        raise CaptureError(
            f"{files.source}/{_WHOLE}: camera model {str(model)[:40]}, a pinhole was expected",
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


def _camera(setting: dict[str, Any], size: tuple[int, int]) -> Intrinsics | None:
    """The camera of a frame; a focal length that it lacks follows from the field of view or is the other's."""
    said = {key: float(n[0]) for key in _CAMERA if (n := finite_numbers(setting.get(key), (1,))) is not None}
    width, height = said.get("w", size[0]), said.get("h", size[1])
    fx = said.get("fl_x") or _focal(said.get("camera_angle_x"), width)
    fy = said.get("fl_y") or _focal(said.get("camera_angle_y"), height) or fx
    fx = fx or fy
    if fx is None or fy is None or min(fx, fy, width, height) < 1:
        return None
    cx, cy = said.get("cx", width / 2), said.get("cy", height / 2)
    return Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=int(width), height=int(height)).resized(*size)


def _focal(angle: float | None, side: float) -> float | None:
    """The focal length that sees `side` pixels under that angle."""
    return float(side / 2 / np.tan(angle / 2)) if angle and 0 < angle < np.pi else None


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
        raise CaptureError(f"{files.source}/{_WHOLE}: depth_unit_scale_factor {str(scale)[:40]}", hint="1e-3 is millimetres")
    return float(scale)


def _colour_of(files: Files, lenses: Mapping[int, Lens], frame: RawFrame) -> Colour:
    content, lens = colour_file(files, frame), lenses.get(frame.index)
    if lens is None:
        return content
    return undistorted(colour_pixels(content, frame.rgb_name), frame.rgb_camera, lens, nearest=False)


def _depth_of(
    files: Files, stored: Callable[[RawFrame], RawDepth], lenses: Mapping[int, Lens], masks: Mapping[int, str], frame: RawFrame
) -> RawDepth:
    metres, confidence, damage = stored(frame)
    if frame.index in masks:
        metres = np.where(_mask(files, masks[frame.index], metres.shape), metres, np.float32(0))
    if frame.index in lenses:
        camera, lens = frame.depth_camera, lenses[frame.index]
        metres = undistorted(metres, camera, lens, nearest=True)
        confidence = None if confidence is None else undistorted(confidence, camera, lens, nearest=True)
    return RawDepth(metres, confidence, damage)


def _mask(files: Files, name: str, shape: tuple[int, ...]) -> np.ndarray:
    white = colour_pixels(files.read(name), name).max(axis=2)
    return np.asarray(cv2.resize(white, shape[::-1], interpolation=cv2.INTER_NEAREST) > 0)


READER = Reader(name="nerfstudio transforms.json", parts=(Part(_WHOLE, _TRANSFORMS),), open=open_nerfstudio)
