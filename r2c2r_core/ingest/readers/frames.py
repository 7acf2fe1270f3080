"""Frames joined by number from a folder's colour, depth, confidence and pose files; nothing is matched by position."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.images import colour_file
from r2c2r_core.ingest.readers.protocol import RawFrame, Recording, UnreadableFrame
from r2c2r_core.ingest.readers.stored_depth import are_depth16, depth_file, depth_size, stored_values
from r2c2r_core.ingest.readers.texts import pose_of_matrix, read_numbers, tried

Cameras = Callable[[int], Intrinsics | None]  # by frame number; None: the frame's own is unusable
Y_UP, Z_UP = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
_MILLIMETRES = 1000.0  # units a metre
_DEPTH16 = "the depth is Android's DEPTH16: its lower 13 bits are read as millimetres, the upper 3 as confidence"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """The files, poses and times of a recording, by frame number."""

    colour: Mapping[int, str]
    depth: Mapping[int, str]
    poses: Mapping[int, Rigid3 | None]  # None: unusable; empty: the recording has none
    confidence: Mapping[int, str] = field(default_factory=dict)
    times_s: Mapping[int, float] = field(default_factory=dict)
    cameras: Mapping[int, str] = field(default_factory=dict)  # files of their own, which are part of the recording


def joined_recording(
    files: Files,
    found: Found,
    rgb_camera: Cameras,
    depth_camera: Cameras | None = None,
    *,
    format: str,
    up_capture: Vector3 | None = None,
    notices: Iterable[str] = (),
    other_names: Iterable[str] = (),
    units_per_metre: float = _MILLIMETRES,
    confidence_levels: tuple[int, int] = (1, 2),
) -> Recording:
    """The recording of the frames that have colour, depth, a camera and a pose; raises CaptureError.

    Depth is of the colour image's view where it has no camera of its own. If the recording has no usable pose at all, its
    frames come without poses, and ingest estimates them.
    """
    if up_capture is not None and len(still := [n for n, pose in found.poses.items() if _is_identity(pose)]) > 1:
        found = replace(found, poses={**found.poses, **dict.fromkeys(still)})  # no camera is held like that in a levelled world
        notices = (*notices, f"{len(still)} poses are the identity, which stands for lost tracking")
    frames, left_out = _joined_frames(files, found, rgb_camera, depth_camera)
    unsure = sum(frame.confidence_name is None for frame in frames) if found.confidence else 0
    if unsure:
        left_out.append(f"{unsure} of {len(frames)} frames have no confidence image: all their depth is used")
    packed = units_per_metre == _MILLIMETRES and not found.confidence and _is_packed(files, frames)
    return Recording(
        format=format,
        files=files,
        frames=frames,
        colour_of=partial(colour_file, files),
        depth_of=partial(depth_file, files, units_per_metre, confidence_levels=confidence_levels, packed=packed),
        up_capture=up_capture,
        notices=(*notices, *left_out, *((_DEPTH16,) if packed else ())),
        other_names=(*other_names, *(found.cameras[f.index] for f in frames if f.index in found.cameras)),
    )


def _joined_frames(
    files: Files, found: Found, rgb_camera: Cameras, depth_camera: Cameras | None
) -> tuple[tuple[RawFrame, ...], list[str]]:
    both, notices = found.colour.keys() & found.depth.keys(), []
    usable = {number for number, pose in found.poses.items() if pose is not None}
    if found.poses and not usable & both and (both & found.poses.keys() or not usable):
        notices.append(
            f"none of {len(both & found.poses.keys()) or len(found.poses)} poses is a finite rigid transform: all are left out"
        )
        found = replace(found, poses={})
    poses = found.poses or dict.fromkeys(found.colour)
    shared = both & poses.keys()
    if not shared:
        counts = f"{len(found.colour)} colour images, {len(found.depth)} depth images, {len(found.poses)} poses"
        hint = "name the colour image, depth image and pose of a frame by the same number"
        raise CaptureError(f"{files.source}: {counts}, none with the same number", hint=hint)
    posed = [number for number in sorted(shared) if poses[number] is not None or not found.poses]
    cameras = {number: camera for number in posed if (camera := rgb_camera(number)) is not None}
    if not cameras:
        raise CaptureError(
            f"{files.source}: none of {len(posed)} frames has a usable camera (focal length and centre)",
            hint="complete the camera files",
        )
    if depth_camera is None:
        size = depth_size(files, (found.depth[number] for number in cameras))
        depth_cameras = {number: camera.resized(*size) for number, camera in cameras.items()}
    else:
        depth_cameras = {number: depth_camera(number) or camera for number, camera in cameras.items()}
    start_s = min(found.times_s.values(), default=0.0)
    frames = tuple(
        RawFrame(
            index=number,
            timestamp_s=found.times_s[number] - start_s if number in found.times_s else None,
            rgb_camera=camera,
            depth_camera=depth_cameras[number],
            capture_from_camera=poses[number],
            rgb_name=found.colour[number],
            depth_name=found.depth[number],
            confidence_name=found.confidence.get(number),
        )
        for number, camera in cameras.items()
    )
    return frames, [*notices, *_left_out(found, shared, len(posed), len(frames))]


def read_poses(files: Files, names: Mapping[int, str]) -> dict[int, Rigid3 | None]:
    """The pose in each of those text files (4x4, camera-to-world, OpenCV axes)."""
    texts = {number: tried(lambda folder, one: folder.read(one), files, name) or b"" for number, name in names.items()}
    read = {number: read_numbers(text) for number, text in texts.items()}  # -inf or NaN where tracking was lost
    return {k: None if n is None or n.size != 16 else pose_of_matrix(n.reshape(4, 4)) for k, n in read.items()}


def _is_identity(pose: Rigid3 | None) -> bool:
    """Whether the file's pose is exactly the identity; the flip of camera axes changes signs only."""
    return pose is not None and not pose.translation.any() and np.array_equal(abs(pose.rotation), np.eye(3))


def _left_out(found: Found, shared: set[int], posed: int, usable: int) -> list[str]:
    every = found.colour.keys() | found.depth.keys() | found.poses.keys()
    poses = found.poses or dict.fromkeys(every)
    lacking = [
        f"{len(every - held.keys())} {what}"
        for what, held in (("a colour image", found.colour), ("a depth image", found.depth), ("a pose", poses))
        if every - held.keys()
    ]
    notices = []
    if lacking:
        notices.append(f"{len(every) - len(shared)} of {len(every)} frames were left out: {', '.join(lacking)} missing")
    if posed < len(shared):
        notices.append(f"{len(shared) - posed} frames have no usable pose and were left out")
    if usable < posed:
        notices.append(f"{posed - usable} frames have no usable camera and were left out")
    return notices


def _is_packed(files: Files, frames: tuple[RawFrame, ...]) -> bool:
    """Whether a few frames' depth is DEPTH16."""
    few = []
    for frame in frames[:: -(-len(frames) // 5)]:
        try:
            few.append(stored_values(files.read(frame.depth_name), frame.depth_name))
        except UnreadableFrame:
            continue
    return bool(few) and all(image.dtype.kind == "u" for image in few) and are_depth16(few)
