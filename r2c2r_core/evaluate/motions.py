"""Metrics of filmed joint motion: per-frame states, limits and interior lengths against truth.

Only joints that open in the recording are scored; for the others, false motions are counted. A frame that shows the front
but has no known state counts as wrong, and so does every frame of a joint that is missing or of another type.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.evaluate.joints import axis_deg, line_distance, mean, pair_joints
from r2c2r_core.evaluate.records import JointRecord, MotionRecord, ObjectRecord
from r2c2r_core.model.report import Metric

STATE_TOLERANCE = {"revolute": float(np.radians(2.0)), "prismatic": 0.006}
"""Within which a state is right: 2 degrees, 6 mm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointScore:
    """Score of one true joint that opens."""

    name: str
    type: str  # the true one
    type_right: bool
    axis_deg: float | None  # None: of another type
    pivot_mm: float | None  # of revolute ones
    shown: int  # frames that show the front
    shown_right: int  # with the right state
    open_shown: int  # those in which it is open
    open_right: int
    limit_right: bool  # right where it is reported as measured; otherwise not below what was seen
    inner_depth_mm: float | None  # signed error; None: not seen, or no truth


def motion_errors(truth: ObjectRecord, found: ObjectRecord) -> tuple[Metric, ...]:
    """Means over the opening joints of an object; a metric that does not apply is None with its reason."""
    scores = joint_scores(truth, found)
    false = false_motions(truth, found)
    shown, shown_open = sum(s.shown for s in scores), sum(s.open_shown for s in scores)
    note = f"{shown} frames show it, {shown_open} of them open" if scores else "no front was opened"
    depths = [abs(s.inner_depth_mm) for s in scores if s.inner_depth_mm is not None]
    limits = [float(s.limit_right) for s in scores]
    right, right_open = sum(s.shown_right for s in scores), sum(s.open_right for s in scores)
    return (
        Metric(name="state", value=_share(right, shown), unit="share", better="higher", tolerance=0.02, note=note),
        Metric(
            name="state_open", value=_share(right_open, shown_open), unit="share", better="higher", tolerance=0.02, note=note
        ),
        Metric(name="limit_source", value=mean(limits), unit="share right", better="higher", tolerance=0.0),
        Metric(name="inner_depth", value=mean(depths), unit="mm", better="lower", tolerance=2.0),
        Metric(name="false_motion", value=false, unit="joints", better="lower", tolerance=0.0),
    )


def joint_scores(truth: ObjectRecord, found: ObjectRecord | None) -> tuple[JointScore, ...]:
    """Scores of all true joints that open; for a missing object everything is wrong."""
    others = () if found is None else found.joints
    return tuple(
        _score(a, a.motion, b) for a, b in pair_joints(truth.joints, others) if a.motion is not None and a.motion.opens
    )


def open_frames(truth: ObjectRecord) -> frozenset[int]:
    """Frames that show an open front of the object."""
    motions = [joint.motion for joint in truth.joints if joint.motion is not None]
    return frozenset(i for motion in motions for i in motion.shown if (motion.states[i] or 0.0) > 0)


def false_motions(truth: ObjectRecord, found: ObjectRecord) -> float | None:
    """Number of joints of an object with falsely reported motion; None where the truth has no motion."""
    pairs = [(a.motion, b) for a, b in pair_joints(truth.joints, found.joints) if a.motion is not None]
    if not pairs:
        return None
    return float(sum(not a.opens and b is not None and _claims_motion(b) for a, b in pairs))


def _score(true: JointRecord, motion: MotionRecord, found: JointRecord | None) -> JointScore:
    same = found is not None and found.type == true.type
    tolerance = STATE_TOLERANCE.get(true.type, 0.0)
    states = found.motion.states if same and found is not None and found.motion is not None else {}
    right = {i for i in motion.shown if _near(states.get(i), motion.states[i], tolerance)}
    ajar = {i for i in motion.shown if (motion.states[i] or 0.0) > 0}
    return JointScore(
        name=true.name,
        type=true.type,
        type_right=same,
        axis_deg=axis_deg(true, found) if same and found is not None else None,
        pivot_mm=1000 * line_distance(true.origin, true.axis, found.origin, found.axis)
        if same and found is not None and true.type == "revolute"
        else None,
        shown=len(motion.shown),
        shown_right=len(right),
        open_shown=len(ajar),
        open_right=len(right & ajar),
        limit_right=same and found is not None and _limit_right(true, motion, found, tolerance),
        inner_depth_mm=_depth_error_mm(motion, found.motion if found is not None else None),
    )


def _near(value: float | None, true: float | None, tolerance: float) -> bool:
    return value is not None and true is not None and abs(value - true) <= tolerance


def _limit_right(true: JointRecord, motion: MotionRecord, found: JointRecord, tolerance: float) -> bool:
    if found.limit_source == "measured":
        return abs(found.upper - true.upper) <= tolerance
    return found.upper >= motion.largest - tolerance


def _depth_error_mm(true: MotionRecord, found: MotionRecord | None) -> float | None:
    inside, seen = true.inside.get("depth_m"), None if found is None else found.inside.get("depth_m")
    return None if inside is None or seen is None else 1000 * (seen - inside)


def _claims_motion(joint: JointRecord) -> bool:
    return joint.motion is not None and joint.motion.largest > STATE_TOLERANCE.get(joint.type, 0.0)


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None
