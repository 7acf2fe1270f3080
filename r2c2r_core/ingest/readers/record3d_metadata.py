"""Record3D's metadata, shared by its .r3d and its EXR+JPG export; every generation of the app.

Facts: K is column-major at RGB resolution; perFrameIntrinsicCoeffs [[fx, fy, cx, cy], ...] is preferred where it exists;
poses are [qx, qy, qz, qw, x, y, z], camera-to-world, OpenGL camera axes; the newer app's world is gravity-aligned with +y up,
the older app's starts at the first camera (poses[0] is the identity) and knows no gravity; pixel centres lie at integers.
"""

from collections.abc import Mapping, Set
from dataclasses import dataclass
from typing import Any

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3
from r2c2r_core.ingest.readers.texts import finite_numbers, integer_centred, parse_json_object, pose_of_quaternion

_TOLERATED_WITHOUT_POSE = 0.02  # the last frames of a recording may lack theirs


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record3DMetadata:
    """Parsed Record3D metadata, in our conventions."""

    source: str
    width: int  # of the RGB images
    height: int
    depth_size: tuple[int, int] | None  # width, height; older apps do not say
    cameras: Mapping[int, Intrinsics]  # of each pose
    poses: Mapping[int, Rigid3 | None]  # capture_from_camera; None where tracking was lost
    times_s: Mapping[int, float]  # from the start, where known
    up_capture: Vector3 | None
    other_ups: tuple[Vector3, ...]  # alternative interpretations of initPose

    def require_poses(self, numbers: Set[int]) -> None:
        """Raise CaptureError when more than the last frames have none."""
        beyond = [n for n in numbers if n >= len(self.poses)]
        if len(beyond) > max(1, _TOLERATED_WITHOUT_POSE * len(numbers)):
            raise CaptureError(
                f"{self.source}: {len(numbers)} frames up to number {max(beyond)}, but {len(self.poses)} poses",
                hint="the metadata belongs to another recording: use its own",
            )


def parse_metadata(content: bytes, source: str) -> Record3DMetadata:
    """Read the JSON; `source` names it in messages. Raises CaptureError."""
    metadata = parse_json_object(content, source)
    width, height = _positive(metadata, "w", source), _positive(metadata, "h", source)
    rows = metadata.get("poses")
    if not isinstance(rows, list) or not rows:
        raise CaptureError(f"{source}: no poses", hint="record with the LiDAR camera and tracking switched on")
    if not any(isinstance(row, list) and len(row) == 7 for row in rows):
        hint = "share the recording from the app again: a pose is qx, qy, qz, qw, x, y, z"
        raise CaptureError(f"{source}: key 'poses' should hold rows of 7 numbers", hint=hint)
    poses = [finite_numbers(row, (7,)) for row in rows]
    has_depth_size = bool(metadata.get("dw")) and bool(metadata.get("dh"))
    fps, times = finite_numbers(metadata.get("fps"), (1,)), metadata.get("frameTimestamps")
    timed = finite_numbers(times, (len(times),)) if isinstance(times, list) else None
    by_rate = {n: float(n / fps[0]) for n in range(len(rows))} if fps is not None and fps[0] > 0 else {}
    ups = _ups(finite_numbers(metadata.get("initPose"), (7,)), poses[0])
    return Record3DMetadata(
        source=source,
        width=width,
        height=height,
        depth_size=(_positive(metadata, "dw", source), _positive(metadata, "dh", source)) if has_depth_size else None,
        cameras=dict(enumerate(_cameras(metadata, width, height, len(rows), source))),
        poses={n: None if row is None else _pose(row) for n, row in enumerate(poses)},
        times_s=by_rate if timed is None else {**by_rate, **dict(enumerate(timed.tolist()))},
        up_capture=ups[0] if ups else None,
        other_ups=ups[1:],
    )


def _cameras(metadata: dict[str, Any], width: int, height: int, count: int, source: str) -> tuple[Intrinsics, ...]:
    """The camera of each frame: its own where it has one, else K's."""
    own, k = metadata.get("perFrameIntrinsicCoeffs"), finite_numbers(metadata.get("K"), (9,))
    common = None if k is None else k[[0, 4, 6, 7]]  # column-major
    rows = [finite_numbers(row, (4,)) for row in own[:count]] if isinstance(own, list) else []
    rows += [None] * (count - len(rows))
    used = [row for own_row in rows if (row := own_row if own_row is not None and min(own_row[:2]) > 0 else common) is not None]
    if len(used) < count or min(min(row[:2]) for row in used) <= 0:
        found = _brief(metadata.get("K"))
        raise CaptureError(
            f"{source}: key 'K' should hold 9 numbers, found {found}; focal lengths should be positive",
            hint="share the recording from the app again, or write fx, 0, 0, 0, fy, 0, cx, cy, 1",
        )
    return tuple(integer_centred(fx, fy, cx, cy, (width, height)) for fx, fy, cx, cy in used)


def _pose(row: np.ndarray) -> Rigid3 | None:
    return pose_of_quaternion(np.concatenate([row[4:], row[:4]]), CAMERA_CV_FROM_GL)


def _ups(first: np.ndarray | None, pose: np.ndarray | None) -> tuple[Vector3, ...]:
    """+y of ARKit's world in the recording's, for each known interpretation of initPose; empty for the older app.

    If initPose is not the identity, it maps the recording's world to ARKit's, or is already included in the poses, or is the
    inverse mapping.
    """
    from scipy.spatial.transform import Rotation

    up = np.array([0.0, 1.0, 0.0])
    if first is not None and 0.5 < np.linalg.norm(first[:4]) < 2.0:
        turn = Rotation.from_quat(first[:4])
        if turn.magnitude() > 1e-4:
            return np.asarray(turn.inv().apply(up)), up, np.asarray(turn.apply(up))
    starts_at_camera = pose is not None and abs(abs(pose[3]) - 1.0) < 1e-5 and np.linalg.norm(pose[4:]) < 1e-6
    return () if starts_at_camera else (up,)


def _positive(metadata: dict[str, Any], key: str, source: str) -> int:
    value = metadata.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 1 <= value < 100_000:
        raise CaptureError(
            f"{source}: key '{key}' should be a positive number of pixels, found {_brief(value)}",
            hint="is this a Record3D export?",
        )
    return int(value)


def _brief(value: object) -> str:
    return "nothing" if value is None else repr(value)[:60]
