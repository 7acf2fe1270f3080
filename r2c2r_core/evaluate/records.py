"""Bundles and truth files as plain records, both in the bundle's world frame."""

import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.documents import MOST_BYTES, parse_json, read_bounded
from r2c2r_core.errors import BundleError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.texts import fault_of

_TRUTH = "give the truth.json that belongs to the recording; r2c2r sample writes one"
_FARTHEST = 1e6  # metres; beyond any kitchen, and squares of larger numbers overflow
MIN_SEEN_PX, MIN_SEEN_SHARE = 400, 0.25
"""From which a frame shows a front: as many of its pixels, and as much of its outline, as a person needs to see its state."""
_POSE_KEYS = ("capture_from_object", "world_from_object", "pose")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionRecord:
    """Motion of a joint in the recording, true or found; states in rad or m, 0 closed."""

    states: Mapping[int, float | None]  # by frame number; None: not known
    shown: frozenset[int]  # truth only: the frames that show its front
    largest: float
    inside: Mapping[str, float]  # lengths in m, by the names of model/motion.py

    @property
    def opens(self) -> bool:
        """Whether a frame that shows the front has it open."""
        return any((self.states[i] or 0.0) > 0 for i in self.shown)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointRecord:
    """One joint; axis and origin in the world frame."""

    name: str
    type: str
    axis: Vector3
    origin: Vector3
    lower: float
    upper: float
    limit_source: str  # "truth", or the manifest's source
    motion: MotionRecord | None = None  # None: not given


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectRecord:
    """One object of a bundle or of a truth file."""

    name: str
    category: str
    dimensions_m: Vector3  # width, depth, height
    world_from_object: Rigid3
    joints: tuple[JointRecord, ...]
    observed_axes: tuple[bool, bool, bool] | None = None  # truth only; None: not stated
    scan_fit: Mapping[str, float] | None = None  # of a bundle: its mesh's fit to the scan, from its manifest; None: unknown
    carried_by: str | None = None  # the drawer that it lies in: its joint in a truth file, its link in a bundle
    turns_freely: bool = False  # truth only: rotationally symmetric about the vertical, so yaw is undefined


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BundleRecord:
    """The content of a manifest used by the evaluation."""

    objects: tuple[ObjectRecord, ...]
    world_from_capture: Rigid3


def read_bundle(path: Path) -> BundleRecord:
    """The manifest of a bundle, zip or folder; raises BundleError when it cannot be read."""
    document = _parse(_manifest_bytes(path), path, "write the bundle again with r2c2r run")
    try:
        world_from_capture = Rigid3.from_matrix(_matrix(document["world_from_capture"]))
        objects = tuple(_object(entry, Rigid3()) for entry in document["objects"])
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise BundleError(
            f"{path}: manifest.json is incomplete or invalid ({fault_of(error)})", hint="write the bundle again with r2c2r run"
        ) from error
    return BundleRecord(objects=objects, world_from_capture=world_from_capture)


def read_truth(path: Path, world_from_capture: Rigid3) -> tuple[ObjectRecord, ...]:
    """The objects of a truth file, transformed from the capture frame to the world; raises BundleError."""
    document = _parse(read_bounded(path, BundleError, hint=_TRUTH), path, _TRUTH)
    try:
        return tuple(_object(entry, world_from_capture) for entry in document["objects"])
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise BundleError(f"{path}: an object is incomplete or invalid ({fault_of(error)})", hint=_TRUTH) from error


def _manifest_bytes(path: Path) -> bytes:
    try:
        if path.is_dir():
            return read_bounded(path / "manifest.json", BundleError, hint="give a bundle's zip or folder")
        with zipfile.ZipFile(path) as bundle:
            names = [name for name in bundle.namelist() if name.split("/")[-1] == "manifest.json" and name.count("/") <= 1]
            if not names:
                raise BundleError(f"{path}: no manifest.json inside", hint="give a bundle written by r2c2r run")
            if bundle.getinfo(names[0]).file_size > MOST_BYTES:
                raise BundleError(
                    f"{path}: manifest.json is larger than {MOST_BYTES >> 20} MiB", hint="write it again with r2c2r run"
                )
            return bundle.read(names[0])
    except (zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise BundleError(f"{path}: not a zip, or truncated", hint="give a bundle written by r2c2r run") from error
    except OSError as error:
        raise BundleError(
            f"{path}: manifest.json cannot be read ({error.strerror})", hint="give a bundle's zip or folder"
        ) from error


def _parse(content: bytes, path: Path, hint: str) -> dict[str, Any]:
    document = parse_json(content, str(path), BundleError, hint=hint)
    if not isinstance(document, dict) or not isinstance(document.get("objects"), list):
        raise BundleError(f"{path}: expected a JSON object with a list `objects`", hint=hint)
    return document


def _object(entry: dict[str, Any], world_from_file: Rigid3) -> ObjectRecord:
    joints = entry.get("joints")
    if joints is None:
        joints = [entry["joint"]] if entry.get("joint") else []
    observed = entry.get("observed_axes")
    return ObjectRecord(
        name=str(entry["name"]),
        category=str(entry["category"]),
        dimensions_m=_vector(entry["dimensions_m"]),
        world_from_object=world_from_file @ Rigid3.from_matrix(_matrix(_pose(entry))),
        joints=tuple(_joint(joint, world_from_file) for joint in joints),
        observed_axes=None if observed is None else (bool(observed[0]), bool(observed[1]), bool(observed[2])),
        scan_fit=_fit(entry.get("scan_fit")),
        carried_by=entry.get("carried_by"),
        turns_freely=entry.get("symmetry") == "axial",
    )


def _fit(values: Any) -> dict[str, float] | None:
    return None if values is None else {str(key): float(value) for key, value in values.items() if value is not None}


def _pose(entry: dict[str, Any]) -> Any:
    for key in _POSE_KEYS:
        if key in entry:
            return entry[key]
    raise KeyError(" or ".join(_POSE_KEYS))


def _joint(entry: dict[str, Any], world_from_file: Rigid3) -> JointRecord:
    origin, axis = joint_line(entry["origin"], entry["axis"], world_from_file)
    return JointRecord(
        name=str(entry.get("name", "")),
        type=str(entry["type"]),
        axis=axis,
        origin=origin,
        lower=float(entry["lower"]),
        upper=float(entry["upper"]),
        limit_source=str(entry.get("source", {}).get("limits", "truth")),
        motion=_true_motion(entry) if "states" in entry else _found_motion(entry.get("motion")),
    )


def joint_line(origin: Any, axis: Any, world_from_file: Rigid3) -> tuple[Vector3, Vector3]:
    """A point and the unit direction of a file's axis, in the world; raises ValueError or TypeError on invalid values."""
    direction = _vector(axis)
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        raise ValueError("a joint axis of length 0")
    return world_from_file.apply(_vector(origin)), world_from_file.turn(direction / length)


def _true_motion(entry: dict[str, Any]) -> MotionRecord:
    """Motion from a truth file: a state for every frame, and the frames that show enough of the front."""
    states = {i: float(value) for i, value in enumerate(entry["states"])}
    seen = zip(entry["seen_px"], entry["seen_share"], strict=True)
    shown = frozenset(i for i, (px, share) in enumerate(seen) if px >= MIN_SEEN_PX and share >= MIN_SEEN_SHARE)
    if any(not np.isfinite(value) for value in states.values()) or not shown <= states.keys():
        raise ValueError("a frame without a state")
    return MotionRecord(
        states=states,
        shown=shown,
        largest=float(entry["largest"]),
        inside=_lengths(entry.get("inside")),
    )


def _found_motion(entry: dict[str, Any] | None) -> MotionRecord | None:
    """Motion from a manifest: states of the frames in which the front was found."""
    if entry is None:
        return None
    states = {int(each["frame"]): None if each["value"] is None else float(each["value"]) for each in entry["states"]}
    return MotionRecord(
        states=states,
        shown=frozenset(),
        largest=float(entry["largest"]),
        inside=_lengths(entry.get("inside")),
    )


def _lengths(entry: dict[str, Any] | None) -> dict[str, float]:
    return {str(key): float(value) for key, value in (entry or {}).items() if isinstance(value, int | float)}


def _vector(values: Any) -> Vector3:
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (3,) or not (np.abs(vector) < _FARTHEST).all():
        raise ValueError(f"three numbers, found {values!r}")
    return vector


def _matrix(values: Any) -> np.ndarray:
    matrix = np.asarray(values, dtype=np.float64)
    if matrix.shape != (4, 4) or not (np.abs(matrix) < _FARTHEST).all():
        raise ValueError(f"a 4x4 matrix of metres, found {values!r}")
    return matrix
