"""Pose metrics: position and yaw of an object."""

import numpy as np

from r2c2r_core.evaluate.records import ObjectRecord
from r2c2r_core.model.report import Metric

_ROUND = "rotationally symmetric about its vertical axis"


def pose_errors(truth: ObjectRecord, found: ObjectRecord) -> tuple[Metric, ...]:
    """Distance of the box centres and of the front faces' centres in mm, and the yaw in degrees.

    The front is reported separately because a built-in unit's back, and with it the centre, is not observed.
    """
    centre = found.world_from_object.translation - truth.world_from_object.translation
    return (
        Metric(name="centre", value=1000 * float(np.linalg.norm(centre)), unit="mm", better="lower", tolerance=3.0),
        _front(truth, found),
        _yaw(truth, found),
    )


def _front(truth: ObjectRecord, found: ObjectRecord) -> Metric:
    off = None if truth.turns_freely else 1000 * float(np.linalg.norm(_front_centre(found) - _front_centre(truth)))
    note = _ROUND if truth.turns_freely else ""
    return Metric(name="front_centre", value=off, unit="mm", better="lower", tolerance=3.0, note=note)


def _front_centre(thing: ObjectRecord) -> np.ndarray:
    half_depth = np.array([[0.0, -thing.dimensions_m[1] / 2, 0.0]])
    return thing.world_from_object.apply(half_depth)[0]


def _yaw(truth: ObjectRecord, found: ObjectRecord) -> Metric:
    if truth.turns_freely:
        return Metric(name="yaw", value=None, unit="deg", better="lower", tolerance=0.3, note=_ROUND)
    return Metric(
        name="yaw", value=abs(float(np.degrees(yaw_between(truth, found)))), unit="deg", better="lower", tolerance=0.3
    )


def yaw_between(truth: ObjectRecord, found: ObjectRecord) -> float:
    """Rotation of the found object about the true one's vertical axis, rad."""
    turn = truth.world_from_object.rotation.T @ found.world_from_object.rotation
    return float(np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]))
