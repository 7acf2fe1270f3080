"""Record3D's metadata, shared by its .r3d and its EXR+JPG export; every generation of the app.

Facts: K is column-major at RGB resolution; perFrameIntrinsicCoeffs [[fx, fy, cx, cy], ...] is preferred where it exists;
poses are [qx, qy, qz, qw, x, y, z], camera-to-world, OpenGL camera axes; the newer app's world is gravity-aligned with +y up,
the older app's starts at the first camera (poses[0] is the identity) and knows no gravity; pixel centres lie at integers.
"""

from collections.abc import Set
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
    cameras: tuple[Intrinsics, ...]  # one for each pose
    poses: tuple[Rigid3 | None, ...]  # capture_from_camera; None where tracking was lost
    timestamps_s: tuple[float, ...] | None
    fps: float | None
    up_capture: Vector3 | None
    other_ups: tuple[Vector3, ...]  # alternative interpretations of initPose

    def camera(self, number: int) -> Intrinsics:
        """The RGB camera of a frame."""
        return self.cameras[number]

    def timestamp(self, number: int) -> float | None:
        """Seconds from the start, where known."""
        if self.timestamps_s is not None and number < len(self.timestamps_s):
            return self.timestamps_s[number]
        return number / self.fps if self.fps else None

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
    raw_poses = _table(metadata, "poses", 7, source)
    if raw_poses is None or not len(raw_poses):
        raise CaptureError(f"{source}: no poses", hint="record with the LiDAR camera and tracking switched on")
    has_depth_size = bool(metadata.get("dw")) and bool(metadata.get("dh"))
    times = metadata.get("frameTimestamps")
    ups = _ups(metadata, raw_poses)
    return Record3DMetadata(
        source=source,
        width=width,
        height=height,
        depth_size=(_positive(metadata, "dw", source), _positive(metadata, "dh", source)) if has_depth_size else None,
        cameras=_cameras(metadata, width, height, len(raw_poses), source),
        poses=tuple(_pose(row) for row in raw_poses),
        timestamps_s=tuple(float(t) for t in times)
        if isinstance(times, list) and _all_numbers(times) and np.isfinite(times).all()
        else None,
        fps=float(metadata["fps"]) if isinstance(metadata.get("fps"), int | float) and metadata["fps"] > 0 else None,
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


def _ups(metadata: dict[str, Any], poses: np.ndarray) -> tuple[Vector3, ...]:
    """+y of ARKit's world in the recording's, for each known interpretation of initPose; empty for the older app.

    If initPose is not the identity, it maps the recording's world to ARKit's, or is already included in the poses, or is the
    inverse mapping.
    """
    from scipy.spatial.transform import Rotation

    up = np.array([0.0, 1.0, 0.0])
    first = metadata.get("initPose")
    if isinstance(first, list) and len(first) == 7 and _all_numbers(first) and 0.5 < np.linalg.norm(first[:4]) < 2.0:
        turn = Rotation.from_quat(np.array(first[:4], dtype=np.float64))
        if turn.magnitude() > 1e-4:
            return np.asarray(turn.inv().apply(up)), up, np.asarray(turn.apply(up))
    starts_at_camera = abs(abs(poses[0, 3]) - 1.0) < 1e-5 and np.linalg.norm(poses[0, 4:]) < 1e-6
    return () if starts_at_camera else (up,)


def _table(metadata: dict[str, Any], key: str, columns: int, source: str) -> np.ndarray | None:
    value = metadata.get(key)
    if value is None:
        return None
    try:
        table = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        table = np.zeros((0, 0))
    if not (isinstance(value, list) and (not value or (table.ndim == 2 and table.shape[1] == columns))):
        raise CaptureError(f"{source}: key '{key}' should hold rows of {columns} numbers", hint="export the recording again")
    return table.reshape(-1, columns)


def _positive(metadata: dict[str, Any], key: str, source: str) -> int:
    value = metadata.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 1 <= value < 100_000:
        raise CaptureError(
            f"{source}: key '{key}' should be a positive number of pixels, found {_brief(value)}",
            hint="is this a Record3D export?",
        )
    return int(value)


def _all_numbers(values: list[Any]) -> bool:
    return all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)


def _brief(value: object) -> str:
    return "nothing" if value is None else repr(value)[:60]
