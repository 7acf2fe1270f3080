"""overrides.json: what a person corrected. An input saved beside the recording; absent keys are computed."""

import json
from pathlib import Path
from typing import Any, get_args

import numpy as np

from r2c2r_core.errors import OverrideError
from r2c2r_core.model.inputs import HingeSide, ObjectOverride, Overrides

NO_OVERRIDES = Overrides(objects={})

_OBJECT_KEYS = ("candidate", "hinge", "dimensions_m", "pose", "joint_limits", "front", "rejected", "regenerate")
MOST_BATCHES = 20  # of further candidates
_SCENE_KEYS = ("up", "floor", "manhattan_yaw", "walls")


def read_overrides(path: Path) -> Overrides:
    """Corrections from `{"version": 1, "objects": {name: {…}}, "scene": {…}}`; unknown keys are refused.

    Per object: candidate (an id, or a mesh file relative to this file), hinge, dimensions_m [w, d, h], pose (4x4
    world_from_object), joint_limits [lower, upper], front [x, y, z] (world), rejected [candidate ids], regenerate (times
    further candidates were asked for). Per scene: up [x, y, z] (capture frame), floor (metres along up), manhattan_yaw (rad),
    walls [[x, y, offset]] (world frame: the normal in plan, into the room, and the plane's distance from the origin along it).
    """
    try:
        document = json.loads(path.read_text())
    except OSError as error:
        raise OverrideError(f"{path}: {error.strerror}", hint="give an overrides.json file") from error
    except ValueError as error:
        raise OverrideError(f"{path}: not JSON ({error})", hint="see README, overrides.json") from error
    return overrides_from(document, path)


def overrides_from(document: Any, path: Path) -> Overrides:
    """Corrections from a parsed document; `path` names it in errors and anchors relative mesh files."""
    where = str(path)
    if not isinstance(document, dict) or document.get("version", 1) != 1:
        raise OverrideError(f"{where}: not an overrides document of version 1", hint='expected {"version": 1, "objects": {…}}')
    listed = document.get("objects", {})
    if isinstance(listed, list):  # prompts.json lists its objects; accept the same habit here
        listed = {entry.get("name", ""): {k: v for k, v in entry.items() if k != "name"} for entry in listed}
    if not isinstance(listed, dict):
        raise OverrideError(f"{where}: objects is {type(listed).__name__}", hint="expected a table of names")
    scene = document.get("scene", {})
    _refuse_unknown(where, "scene", scene, _SCENE_KEYS)
    walls = scene.get("walls")
    if walls is not None and not isinstance(walls, list):
        raise OverrideError(f"{where}: scene.walls is {walls!r}", hint="expected a list of [x, y, offset]")
    floor, yaw = (_numbers(where, f"scene.{key}", scene.get(key), (), "a number") for key in ("floor", "manhattan_yaw"))
    return Overrides(
        objects={name: _object_override(where, name, entry, path.parent) for name, entry in listed.items()},
        up_capture=_vector(where, "scene.up", scene.get("up")),
        floor_m=None if floor is None else float(floor),
        manhattan_yaw_rad=None if yaw is None else float(yaw),
        walls=None if walls is None else tuple(_wall(where, wall) for wall in walls),
    )


def _object_override(where: str, name: str, entry: Any, folder: Path) -> ObjectOverride:
    _refuse_unknown(where, name, entry, _OBJECT_KEYS)
    hinge = entry.get("hinge")
    if hinge is not None and hinge not in get_args(HingeSide):
        raise OverrideError(f"{where}: {name}.hinge is {hinge!r}", hint="expected left, right, top or bottom")
    pose = _numbers(where, f"{name}.pose", entry.get("pose"), (4, 4), "a 4x4 world_from_object")
    if pose is not None and not _is_rigid(pose):
        raise OverrideError(f"{where}: {name}.pose moves nothing rigidly", hint="expected a rotation and a translation")
    limits = _numbers(where, f"{name}.joint_limits", entry.get("joint_limits"), (2,), "[lower, upper]")
    if limits is not None and limits[0] > limits[1]:
        raise OverrideError(f"{where}: {name}.joint_limits is {limits.tolist()}", hint="expected [lower, upper]")
    dimensions = _vector(where, f"{name}.dimensions_m", entry.get("dimensions_m"))
    if dimensions is not None and (dimensions <= 0).any():
        raise OverrideError(f"{where}: {name}.dimensions_m is {dimensions.tolist()}", hint="expected three positive metres")
    regenerate = entry.get("regenerate", 0)
    if not isinstance(regenerate, int) or not 0 <= regenerate <= MOST_BATCHES:
        raise OverrideError(f"{where}: {name}.regenerate is {regenerate!r}", hint=f"expected 0 to {MOST_BATCHES}")
    candidate = entry.get("candidate")
    if candidate is not None and (folder / candidate).is_file():
        candidate = str((folder / candidate).resolve())
    return ObjectOverride(
        candidate=candidate,
        hinge=hinge,
        dimensions_m=dimensions,
        pose=pose,
        joint_lower=None if limits is None else float(limits[0]),
        joint_upper=None if limits is None else float(limits[1]),
        front_world=_vector(where, f"{name}.front", entry.get("front")),
        rejected=tuple(entry.get("rejected", ())),
        regenerate=regenerate,
    )


def _is_rigid(pose: np.ndarray) -> bool:
    """Whether a 4x4 is a rotation (within what rounding to two decimals does to it) and a translation."""
    rotation = pose[:3, :3]
    if not np.isfinite(pose).all() or not np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0)):
        return False
    return bool(np.allclose(rotation.T @ rotation, np.eye(3), atol=0.03) and np.linalg.det(rotation) > 0)


def _refuse_unknown(where: str, what: str, entry: Any, known: tuple[str, ...]) -> None:
    if not isinstance(entry, dict):
        raise OverrideError(f"{where}: {what} is {type(entry).__name__}", hint=f"expected a table with {', '.join(known)}")
    for key in entry:
        if key not in known:
            raise OverrideError(f"{where}: unknown key '{key}' in {what}", hint=f"expected {', '.join(known)}")


def _vector(where: str, what: str, value: Any) -> np.ndarray | None:
    return _numbers(where, what, value, (3,), "three numbers")


def _wall(where: str, value: Any) -> np.ndarray:
    wall = _vector(where, "a wall of scene.walls", value)
    if wall is None:
        raise OverrideError(f"{where}: a wall of scene.walls is null", hint="expected a list of [x, y, offset]")
    return wall


def _numbers(where: str, what: str, value: Any, shape: tuple[int, ...], expected: str) -> np.ndarray | None:
    """Finite numbers of that shape, or None where nothing is said; a text or a ragged list is an OverrideError."""
    if value is None:
        return None
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.full(1, np.nan)
    if numbers.shape != shape or not np.isfinite(numbers).all() or isinstance(value, bool | str):
        raise OverrideError(f"{where}: {what} is {str(value)[:80]!r}", hint=f"expected {expected}")
    return numbers
