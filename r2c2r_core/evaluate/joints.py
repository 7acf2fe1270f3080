"""Joint metrics: type, hinge side, axis, pivot, limits, and the paper's range ratio."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from r2c2r_core.evaluate.records import JointRecord, ObjectRecord
from r2c2r_core.model.report import Metric


def joint_errors(truth: ObjectRecord, found: ObjectRecord) -> tuple[Metric, ...]:
    """The means over the object's joints; a missing or surplus joint counts as a wrong type."""
    if not truth.joints and not found.joints:
        return _metrics([1.0], [], [], [], [], [], [], note="no joint in truth or result")
    pairs = pair_joints(truth.joints, found.joints)
    surplus = max(len(found.joints) - len(truth.joints), 0)
    types = [float(b is not None and a.type == b.type) for a, b in pairs] + [0.0] * surplus
    same = [(a, b) for a, b in pairs if b is not None and a.type == b.type]
    hinged = [(a, b) for a, b in same if a.type == "revolute"]
    sliding = [(a, b) for a, b in same if a.type == "prismatic"]
    hinges = [float(b is not None and _hinge_agrees(truth, found, a, b)) for a, b in pairs if a.type == "revolute"]
    ratios = [_range_ratio(a, b) for a, b in pairs] + [0.0] * surplus
    return _metrics(
        types,
        hinges,
        [axis_deg(a, b) for a, b in same],
        [1000 * line_distance(a.origin, a.axis, b.origin, b.axis) for a, b in hinged],
        [float(np.degrees(abs(_range(a) - _range(b)))) for a, b in hinged],
        [1000 * abs(_range(a) - _range(b)) for a, b in sliding],
        ratios,
        note=", ".join(sorted({f"limits {joint.limit_source}" for joint in found.joints})),
    )


def line_distance(origin_a: np.ndarray, axis_a: np.ndarray, origin_b: np.ndarray, axis_b: np.ndarray) -> float:
    """Shortest distance between two lines with unit directions, in their unit."""
    apart = origin_b - origin_a
    normal = np.cross(axis_a, axis_b)
    length = float(np.linalg.norm(normal))
    if length < 1e-6:  # parallel
        return float(np.linalg.norm(apart - (apart @ axis_a) * axis_a))
    # Nearly parallel lines meet far away, which is meaningless for the hinge: measure across at its middle.
    if length < np.sin(np.radians(10)):
        along = axis_b * float(apart @ axis_a) / float(axis_b @ axis_a)
        return float(np.linalg.norm(apart - along))
    return abs(float(apart @ normal)) / length


def pair_joints(
    truths: tuple[JointRecord, ...], found: tuple[JointRecord, ...]
) -> list[tuple[JointRecord, JointRecord | None]]:
    """Each true joint with its found one, by the assignment with minimum total distance of origins."""
    if not found:
        return [(joint, None) for joint in truths]
    cost = np.array([[float(np.linalg.norm(a.origin - b.origin)) + (a.type != b.type) for b in found] for a in truths])
    rows, columns = linear_sum_assignment(cost.reshape(len(truths), len(found)))
    partner = dict(zip(rows.tolist(), columns.tolist(), strict=True))
    return [(joint, found[partner[i]] if i in partner else None) for i, joint in enumerate(truths)]


def _hinge_agrees(truth: ObjectRecord, found: ObjectRecord, a: JointRecord, b: JointRecord) -> bool:
    """Whether the hinge is at the same edge of the front, seen from outside, and opens the same way."""
    if b.type != "revolute" or float(a.axis @ b.axis) < np.cos(np.radians(45)):
        return False
    return _side(truth, a) == _side(found, b)


def _side(thing: ObjectRecord, joint: JointRecord) -> str:
    """Side on which the hinge line passes the box's centre: left, right, top or bottom."""
    axis = thing.world_from_object.inverse.turn(joint.axis)
    origin = thing.world_from_object.inverse.apply(joint.origin)
    if abs(axis[2]) > abs(axis[0]):
        # Of two leaves each hinge lies on its own half, so the sign alone tells left from right.
        return "left" if origin[0] < 0 else "right"
    return "bottom" if origin[2] < 0 else "top"


def axis_deg(a: JointRecord, b: JointRecord) -> float:
    """Angle between two axes regardless of sign, degrees."""
    return float(np.degrees(np.arccos(np.clip(abs(float(a.axis @ b.axis)), 0.0, 1.0))))


def _range(joint: JointRecord) -> float:
    return joint.upper - joint.lower


def _range_ratio(a: JointRecord, b: JointRecord | None) -> float:
    """Joint articulation accuracy as the paper's table 3 is read: 1 - |range - true range| / true range, at least 0."""
    if b is None or a.type != b.type:
        return 0.0
    return 1.0 - min(1.0, abs(_range(a) - _range(b)) / max(_range(a), 1e-9))


def _metrics(
    types: list[float],
    hinges: list[float],
    axes: list[float],
    pivots: list[float],
    limits_deg: list[float],
    limits_mm: list[float],
    ratios: list[float],
    *,
    note: str,
) -> tuple[Metric, ...]:
    return (
        Metric(name="joint_type", value=mean(types), unit="share right", better="higher", tolerance=0.0, note=note),
        Metric(name="hinge_side", value=mean(hinges), unit="share right", better="higher", tolerance=0.0),
        Metric(name="axis", value=mean(axes), unit="deg", better="lower", tolerance=0.3),
        Metric(name="pivot", value=mean(pivots), unit="mm", better="lower", tolerance=3.0),
        Metric(name="limit_revolute", value=mean(limits_deg), unit="deg", better="lower", tolerance=2.0),
        Metric(name="limit_prismatic", value=mean(limits_mm), unit="mm", better="lower", tolerance=10.0),
        Metric(name="range_ratio", value=mean(ratios), unit="share", better="higher", tolerance=0.02),
    )


def mean(values: list[float]) -> float | None:
    """Their mean; None where there are none."""
    return float(np.mean(values)) if values else None
