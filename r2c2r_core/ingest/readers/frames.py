"""Frames joined by number from a folder's colour, depth, confidence and pose files; nothing is matched by position."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.protocol import RawFrame
from r2c2r_core.ingest.readers.texts import read_pose


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """The files, poses and times of a recording, by frame number."""

    colour: Mapping[int, str]
    depth: Mapping[int, str]
    poses: Mapping[int, Rigid3 | None]  # None: unusable; empty: the recording has none
    confidence: Mapping[int, str] = field(default_factory=dict)
    times_s: Mapping[int, float] = field(default_factory=dict)


def joined_frames(
    files: Files, found: Found, rgb_camera: Callable[[int], Intrinsics], depth_camera: Callable[[int], Intrinsics]
) -> tuple[tuple[RawFrame, ...], list[str]]:
    """The frames that have colour, depth and a pose, and notices about the others; raises CaptureError.

    If the recording has no usable pose at all, its frames come without poses, and ingest estimates them.
    """
    notices = []
    if found.poses and not any(pose is not None for pose in found.poses.values()):
        notices.append(f"none of {len(found.poses)} poses is a finite rigid transform: all are left out")
        found = replace(found, poses={})
    poses = found.poses or dict.fromkeys(found.colour)
    shared = found.colour.keys() & found.depth.keys() & poses.keys()
    if not shared:
        counts = f"{len(found.colour)} colour images, {len(found.depth)} depth images, {len(found.poses)} poses"
        raise CaptureError(f"{files.source}: {counts}, none with the same number", hint="export or copy the recording again")
    start_s = min(found.times_s.values(), default=0.0)
    frames = tuple(
        RawFrame(
            index=number,
            timestamp_s=found.times_s[number] - start_s if number in found.times_s else None,
            rgb_camera=rgb_camera(number),
            depth_camera=depth_camera(number),
            capture_from_camera=pose,
            rgb_name=found.colour[number],
            depth_name=found.depth[number],
            confidence_name=found.confidence.get(number),
        )
        for number in sorted(shared)
        if (pose := poses[number]) is not None or not found.poses
    )
    if not frames:
        raise CaptureError(
            f"{files.source}: none of the {len(shared)} frames with colour and depth has a finite rigid transform as pose",
            hint="remove the pose files to have the poses estimated",
        )
    return frames, [*notices, *_left_out(found, shared, len(frames))]


def read_poses(files: Files, names: Mapping[int, str]) -> dict[int, Rigid3 | None]:
    """The pose in each of those text files (4x4, camera-to-world, OpenCV axes)."""
    return {number: read_pose(files.read(name)) for number, name in names.items()}


def _left_out(found: Found, shared: set[int], posed: int) -> list[str]:
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
    return notices
