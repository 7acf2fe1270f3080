"""Joint parameters from motions in the recording: joint type, hinge side, axis and limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.motion import DRAWER, Inside, JointMotion, JointType, Source
from r2c2r_core.model.rectangle import HINGE_AXES, TOWARDS
from r2c2r_core.model.scene import Box, Joint
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.fixtures.carcass import Params as BoardParams
from r2c2r_core.synthesize.fixtures.spec import Below, Motion, Part
from r2c2r_core.tuning import param, tuned

_DEPTH = np.array([0.0, 1.0, 0.0])  # into the furniture


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters for fusing filmed joints with the usual ones."""

    same_line: float = param(
        3.1,
        "σ",
        "Maximum Mahalanobis distance of a hinge from its front's edge for it to be at the edge",
        source="95 % quantile of four degrees of freedom",
    )
    hinge_m: float = param(
        0.006,
        "m",
        "Standard deviation of a hinge from its front's measured edge",
        source="between an edge's own error, 3-5 mm, and concealed hinges, 5-20 mm inside; least error on eleven sample doors",
    )
    spare_m: float = param(
        0.001,
        "m",
        "Maximum distance that a leaf may swing beyond its edge, within the gap around it",
        source="2-4 mm gaps",
    )
    face_rad: float = param(float(np.deg2rad(0.3)), "rad", "Standard deviation of a front's direction")


def opened_as(spec: Category, motions: tuple[JointMotion, ...], world_from_object: Rigid3) -> tuple[Category, str | None]:
    """Category of a front by its filmed motion, and a notice for a person if it was labelled otherwise."""
    if spec.over_drawer is not None and _drawer(motions) is not None:
        return replace(spec, fixture=spec.over_drawer), None
    if spec.kind != "front" or spec.several_fronts or len(motions) != 1:
        return spec, None
    way = motions[0].movement(world_from_object.rotation[:, 1])
    if way in (spec.motion, "none") or (way == "hinge" and spec.motion == "none"):
        return spec, None
    other = category_of({"hinge": "cabinet", "out": "drawer", "along": "sliding_door"}[way])
    moved = {"hinge": "swings", "out": "is drawn out", "along": "slides along its front"}[way]
    return other, f"called a {spec.label}, but the scan shows that it {moved}: built as a {other.label}"


def side_filmed(item: MeasuredObject) -> HingeSide | None:
    """The edge on which its only leaf is hinged, or towards which it slides, according to the recording."""
    leaves = [motion for motion in item.motions if motion.part != DRAWER]
    if len(leaves) != 1:
        return None
    axis = _axis(leaves[0], item.placed_pose)
    axes = HINGE_AXES if leaves[0].kind == "revolute" else TOWARDS
    return max(axes, key=lambda side: float(axis @ axes[side]))


def filmed(motions: Sequence[JointMotion], placed_pose: Rigid3, motion: Motion) -> JointMotion | None:
    """Filmed motion of a part; None without one, or if its joint is of another kind: a person may have changed it."""
    found = next((one for one in motions if is_of(one.part, motion.part)), None)
    if found is None or found.kind != motion.type:
        return None
    return found if float(_axis(found, placed_pose) @ motion.axis_object) > np.sqrt(0.5) else None


def is_of(leaf: str, part: str) -> bool:
    """Whether a leaf, as named by its motion, is that part of its object."""
    return leaf in ("", part.partition("_")[0])


def inside_seen(item: MeasuredObject) -> Inside | None:
    """Observed interior of its leaves' common compartment; shelves are taken from the leaf that showed most."""
    seen = [motion.inside for motion in item.motions if motion.inside is not None and motion.part != DRAWER]
    if not seen:
        return None
    return Inside(
        depth_m=max((one.depth_m for one in seen if one.depth_m is not None), default=None),
        height_m=max((one.height_m for one in seen if one.height_m is not None), default=None),
        shelves_m=max((one.shelves_m for one in seen), key=len),
    )


def drawer_below(item: MeasuredObject) -> Below | None:
    """The drawer below its doors, from the object's lower edge to as far above the drawer's centre."""
    drawer = _drawer(item.motions)
    if drawer is None or drawer.pivot_world is None:
        return None
    middle = float(item.placed_pose.inverse.apply(drawer.pivot_world)[2])
    return Below(seam_m=2 * middle + float(item.dimensions_m[2]) / 2, inside=drawer.inside)


def as_filmed(motion: Motion, found: JointMotion | None, placed_pose: Rigid3, leaf: Part) -> Motion:
    """The joint about the filmed line where that differs significantly from its front's edge.

    Otherwise along that edge, and through the mean of both, weighted by their covariances. Hinges are limited to positions
    about which the leaf can turn.
    """
    if found is None or found.covariance is None or found.pivot_world is None:
        return motion
    axis, pivot = _axis(found, placed_pose), placed_pose.inverse.apply(found.pivot_world)
    shift = pivot - motion.origin_object
    shift = shift - motion.axis_object * float(shift @ motion.axis_object)
    if motion.type == "prismatic":
        shift = np.zeros(3)
    off = np.concatenate([np.cross(motion.axis_object, axis), shift])
    turn = np.kron(np.eye(2), placed_pose.rotation.T)
    params = tuned(Params)
    measured = turn @ found.covariance @ turn.T
    known = np.diag([params.face_rad**2] * 3 + [params.hinge_m**2] * 3)
    distance = float(np.sqrt(off @ np.linalg.inv(measured + known) @ off))
    thick_m = max((float(board.size_m[1]) for board in leaf.boxes if board.role == "front"), default=np.inf)
    if distance > params.same_line:
        clear = _clearing(shift, motion.axis_object, thick_m)
        straight = motion.axis_object if (clear != shift).any() else axis  # a limited hinge has no room for a slanting axis
        return replace(motion, axis_object=straight, origin_object=motion.origin_object + clear)
    mean = known[3:, 3:] @ np.linalg.inv(measured[3:, 3:] + known[3:, 3:]) @ shift
    return replace(motion, origin_object=motion.origin_object + _clearing(mean, motion.axis_object, thick_m))


def hinge_notice(motion: Motion, found: JointMotion | None, placed_pose: Rigid3) -> str | None:
    """A line where the joint is far from its filmed hinge."""
    if motion.type != "revolute" or found is None or found.pivot_world is None:
        return None
    arm = placed_pose.inverse.apply(found.pivot_world) - motion.origin_object
    off_m = float(np.linalg.norm(np.cross(arm, motion.axis_object)))
    if off_m <= 2 * tuned(Params).hinge_m:
        return None
    where = f"{motion.part}: its hinge was filmed {1000 * off_m:.0f} mm from where it is built"
    return f"{where}: it was measured too roughly, or its leaf could not turn there; check the clicks at its edges"


def _clearing(shift: Vector3, axis: Vector3, thick_m: float) -> Vector3:
    """A hinge's shift from its leaf's edge (object frame), limited so that the edge swings clear.

    In depth: of its neighbours. Inwards: of the carcass behind a leaf of `thick_m`, which `swinging_clear` thins.
    """
    inward = np.cross(-_DEPTH, axis)
    inwards, depth, spare = float(shift @ inward), float(shift @ _DEPTH), tuned(Params).spare_m
    carcass, rear = thick_m + spare, min(tuned(BoardParams).thinnest_front_m, thick_m)

    def deepest(at: float) -> float:
        return float(np.sqrt(spare * (2 * max(at, 0.0) + spare)))

    farthest = np.sqrt((carcass - rear) * max(carcass + rear - 2 * min(depth, deepest(inwards)), 0.0))
    kept = min(inwards, farthest)
    return shift - inward * (inwards - kept) - _DEPTH * max(depth - deepest(kept), 0.0)


def swinging_clear(leaf: Part, edge: Vector3, motion: Motion) -> Part:
    """A hinged leaf, its boards as much thinner as their rear edge needs to swing clear of the carcass.

    `edge` is a point of the leaf's outer edge on the hinge's side (object frame). Boards keep a front's minimum thickness.
    """
    shift = motion.origin_object - edge
    inwards, depth = float(shift @ np.cross(-_DEPTH, motion.axis_object)), float(shift @ _DEPTH)
    if motion.type != "revolute" or inwards <= 0:
        return leaf

    def thinner(board: Box) -> Box:
        reach = float(board.size_m[1]) + tuned(Params).spare_m - depth  # of the rear edge when it passes the carcass
        fits = depth + np.sqrt(max(reach**2 - inwards**2, 0.0))
        excess = float(board.size_m[1]) - max(fits, tuned(BoardParams).thinnest_front_m)
        cut = _DEPTH * max(excess, 0.0)
        place = replace(board.link_from_box, translation=board.link_from_box.translation - cut / 2)
        return replace(board, size_m=board.size_m - cut, link_from_box=place) if board.role == "front" else board

    return replace(leaf, boxes=tuple(thinner(board) for board in leaf.boxes))


def opening(motion: Motion, found: JointMotion | None, most: float) -> tuple[float, Source]:
    """Upper limit of a part and its source: the category's, or the filmed maximum where that is larger.

    A hand that holds a leaf still looks like a stop, so no filmed motion proves a smaller limit.
    """
    if found is None or not motion.upper < found.largest <= most:  # beyond the possible range: a measurement error
        return motion.upper, "default"
    return found.largest, "at_least"


def opened_alike(joints: Sequence[Joint]) -> list[Joint]:
    """The joints of one object, hinged ones with the widest opening of them and its source: a pair has equal hinges.

    Limits of a person, and those that an obstacle cuts, are kept.
    """
    free = [joint for joint in joints if joint.type == "revolute" and joint.sources["limits"] in ("default", "at_least")]
    wide = max(free, key=lambda joint: joint.upper, default=None)
    return [
        replace(joint, upper=wide.upper, sources={**joint.sources, "limits": wide.sources["limits"]})
        if wide is not None and any(joint is one for one in free)
        else joint
        for joint in joints
    ]


def widest(axis_object: Vector3, kind: JointType, dimensions_m: Vector3) -> float:
    """Maximum possible travel: a drawer its unit's depth, a sliding leaf its own length, a door half a turn."""
    return np.pi if kind == "revolute" else float(np.abs(axis_object) @ dimensions_m)


def _drawer(motions: tuple[JointMotion, ...]) -> JointMotion | None:
    return next((motion for motion in motions if motion.part == DRAWER), None)


def _axis(motion: JointMotion, world_from_object: Rigid3) -> np.ndarray:
    assert motion.axis_world is not None  # a fixed part has no motion
    return np.asarray(world_from_object.inverse.turn(motion.axis_world))
