"""What was filmed of an object's joints, as its fixture takes it: what it is, on which side, about which line and how far."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.motion import JointMotion, Source
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.fixtures.spec import Motion
from r2c2r_core.tuning import param, tuned

Way = Literal["hinge", "out", "along"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """When what was filmed and what is usual are the same."""

    same_line: float = param(
        3.1, "σ", "from its front's edge, within which a hinge is at it", source="19 of 20 lie within, of four numbers"
    )
    edge_m: float = param(0.004, "m", "standard deviation of a front's edge", source="benchmarks/segment_fronts.py: 3-5 mm")
    face_rad: float = param(float(np.deg2rad(0.3)), "rad", "standard deviation of a front's direction")


def opened_as(spec: Category, motions: tuple[JointMotion, ...], world_from_object: Rigid3) -> tuple[Category, str | None]:
    """What a front is by how it was filmed to open, and what a person should know where it was called something else."""
    if spec.kind != "front" or spec.several_fronts or len(motions) != 1:
        return spec, None
    way = _way(motions[0], world_from_object)
    usual: dict[str, Way] = {"drawer": "out", "sideways": "along"}
    if way == usual.get(spec.opens, "hinge"):
        return spec, None
    other = category_of({"hinge": "cabinet", "out": "drawer", "along": "sliding_door"}[way])
    moved = {"hinge": "swings", "out": "is drawn out", "along": "slides along its front"}[way]
    return other, f"called a {spec.label}, but the scan shows that it {moved}: built as a {other.label}"


def side_filmed(item: MeasuredObject) -> HingeSide | None:
    """The edge that its one leaf was filmed to hang on, or to slide to."""
    if len(item.motions) != 1:
        return None
    axis = _axis(item.motions[0], item.placed_pose)
    across, up = float(axis[0]), float(axis[2])
    if _way(item.motions[0], item.placed_pose) == "hinge":
        return ("right" if up > 0 else "left") if abs(up) > abs(across) else ("bottom" if across > 0 else "top")
    return ("right" if across > 0 else "left") if abs(across) > abs(up) else ("top" if up > 0 else "bottom")


def filmed(item: MeasuredObject, motion: Motion) -> JointMotion | None:
    """What was filmed of a part; None where nothing was, or its joint is another one: a person may have said so."""
    found = next((one for one in item.motions if one.part in ("", motion.part.partition("_")[0])), None)
    if found is None or found.kind != motion.type:
        return None
    return found if float(_axis(found, item.placed_pose) @ motion.axis_object) > np.sqrt(0.5) else None


def as_filmed(motion: Motion, found: JointMotion | None, placed_pose: Rigid3) -> Motion:
    """The joint about the line that was filmed, where that differs from its front's edge by more than either is known to."""
    if found is None or found.covariance is None or found.pivot_world is None:
        return motion
    axis, pivot = _axis(found, placed_pose), placed_pose.inverse.apply(found.pivot_world[None])[0]
    shift = pivot - motion.origin_object
    shift = shift - motion.axis_object * float(shift @ motion.axis_object)
    if motion.type == "prismatic":
        shift = np.zeros(3)
    off = np.concatenate([np.cross(motion.axis_object, axis), shift])
    turn = np.kron(np.eye(2), placed_pose.rotation.T)
    params = tuned(Params)
    known = np.diag([params.face_rad**2] * 3 + [params.edge_m**2] * 3)
    distance = float(np.sqrt(off @ np.linalg.inv(turn @ found.covariance @ turn.T + known) @ off))
    if distance < params.same_line:
        return motion
    return replace(motion, axis_object=axis, origin_object=motion.origin_object + shift)


def opening(motion: Motion, found: JointMotion | None, most: float) -> tuple[float, Source]:
    """How far a part opens: to the stop that was filmed, at least as far as it was seen, or as its category does."""
    if found is None or found.largest > most:  # further than it can: an error
        return motion.upper, "default"
    if found.stop_seen:
        return found.largest, "measured"
    return (found.largest, "at_least") if found.largest > motion.upper else (motion.upper, "default")


def _axis(motion: JointMotion, world_from_object: Rigid3) -> np.ndarray:
    assert motion.axis_world is not None  # what is fixed is no motion of a leaf
    return np.asarray(world_from_object.inverse.turn(motion.axis_world[None])[0])


def _way(motion: JointMotion, world_from_object: Rigid3) -> Way:
    if motion.kind == "revolute":
        return "hinge"
    return "out" if abs(float(_axis(motion, world_from_object)[1])) > np.sqrt(0.5) else "along"
