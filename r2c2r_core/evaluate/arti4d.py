"""Evaluation of a bundle against a raw Arti4D sequence: direction and position of the joint axes that were opened.

The truth (SEQUENCE.json: object → position, axis) is in the world of the sequence's odometry, which is the recording's own.
Its names match no prompts, so joints are assigned to the nearest axes. It gives neither type nor states: none is scored.
Arti4D's own errors are reported too: the angle, and the distance of a point of the found axis from the true line.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from r2c2r_core.arrays import Vector3
from r2c2r_core.documents import read_json
from r2c2r_core.errors import BundleError
from r2c2r_core.evaluate.joints import axis_deg, line_distance
from r2c2r_core.evaluate.records import JointRecord, joint_line, read_bundle
from r2c2r_core.evaluate.stage import Evaluation, ObjectRow, scene_metrics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.report import Metric
from r2c2r_core.texts import fault_of

_FARTHEST_M = 1.0  # maximum distance between a true axis and its assigned joint
_HINT = "give the folder of a raw sequence: rgb/, depth/, odom/ and SEQUENCE.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    name: str  # of the object
    joint: JointRecord


def evaluate_arti4d(bundle: Path, sequence: Path) -> Evaluation:
    """Compare a bundle made of that sequence with its axes; raises BundleError for a file of either that cannot be read."""
    record = read_bundle(bundle)
    truths = read_axes(sequence, record.world_from_capture)
    found = [_Found(name=item.name, joint=joint) for item in record.objects for joint in item.joints]
    taken = _matched(truths, found)
    rows = tuple(_row(true, match) for true, match in zip(truths, taken, strict=True))
    names = {match.name for match in taken if match is not None}
    surplus = tuple(dict.fromkeys(each.name for each in found if each.joint.motion is not None and each.name not in names))
    return Evaluation(rows=rows, scene=scene_metrics(rows), surplus=surplus)


def read_axes(sequence: Path, world_from_capture: Rigid3) -> tuple[JointRecord, ...]:
    """The true axes of a sequence, in the bundle's world; raises BundleError."""
    path = _truth_file(sequence)
    document = read_json(path, BundleError, hint=_HINT)
    try:
        return tuple(_axis(name, entry, world_from_capture) for name, entry in document.items())
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BundleError(
            f"{path}: an object is incomplete or invalid ({fault_of(error)})", hint="expected {object: {position, axis}}"
        ) from error


def _truth_file(sequence: Path) -> Path:
    """The JSON named like its folder, else like its odometry."""
    names = [sequence.resolve().name, *(file.stem for file in sorted((sequence / "odom").glob("*.csv")))]
    files = [sequence / f"{name}.json" for name in names]
    found = next((file for file in files if file.is_file()), None)
    if found is None:
        raise BundleError(f"{files[0]}: no such file", hint=_HINT)
    return found


def _axis(name: str, entry: dict[str, Any], world_from_capture: Rigid3) -> JointRecord:
    origin, axis = joint_line(entry["position"], entry["axis"], world_from_capture)
    return JointRecord(name=name, type="", axis=axis, origin=origin, lower=0.0, upper=0.0, limit_source="truth")


def _matched(truths: tuple[JointRecord, ...], found: list[_Found]) -> list[_Found | None]:
    """Assignment of found joints to true axes with minimum total distance."""
    matches: list[_Found | None] = [None] * len(truths)
    if truths and found:
        cost = np.array([[_apart(true, each.joint) for each in found] for true in truths])
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            matches[row] = found[column] if cost[row, column] <= _FARTHEST_M else None
    return matches


def _apart(true: JointRecord, found: JointRecord) -> float:
    """Assignment cost: distance of the true position from the found axis and origin, m, plus a term for the angle."""
    along = abs(float((found.origin - true.origin) @ found.axis))
    return line_point(found.origin, found.axis, true.origin) + 0.2 * along + axis_deg(true, found) / 90


def line_point(origin: Vector3, axis: Vector3, point: Vector3) -> float:
    """Distance of a point from a line."""
    return float(np.linalg.norm(np.cross(point - origin, axis)))


def _row(true: JointRecord, found: _Found | None) -> ObjectRow:
    if found is None:
        return ObjectRow(name=true.name, category="", matched=None, metrics=())
    joint, hinged = found.joint, found.joint.type == "revolute"
    pivot = 1000 * line_distance(true.origin, true.axis, joint.origin, joint.axis) if hinged else None
    theirs = line_point(true.origin, true.axis, joint.origin) if hinged else None
    measured = float(joint.motion is not None)
    note = "" if hinged else "hinges only"
    metrics = (
        Metric(name="axis", value=axis_deg(true, joint), unit="deg", better="lower", tolerance=0.3),
        Metric(name="pivot", value=pivot, unit="mm", better="lower", tolerance=3.0, note=note),
        Metric(name="pivot_arti4d", value=theirs, unit="m", better="lower", tolerance=0.003, note=note),
        Metric(name="joint_measured", value=measured, unit="share", better="higher", tolerance=0.0),
    )
    return ObjectRow(name=true.name, category=joint.type, matched=found.name, metrics=metrics)
