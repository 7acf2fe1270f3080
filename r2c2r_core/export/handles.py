"""Handles of a scene: pose, grasp, and free space for a gripper.

A piece of a handle is a box of the role `handle`; touching pieces form one handle, and its grip is the piece farthest out. A
front without a handle is pushed: a door at its free edge, a drawer in the middle of its front.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.export.free_room import Prism, Solid, free_length, solids_of
from r2c2r_core.export.plan import Body, Plan
from r2c2r_core.failing import apart
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.handle import Handle, HandleKind, Room
from r2c2r_core.model.scene import Box, Joint

FAR_M = 0.3
"""No room is measured farther than this."""

_INTO = np.array([0.0, 1.0, 0.0])  # a link's axes are its object's, whose front is at -y
_TOUCH_M = 0.002  # pieces of one handle
_INSET_M = 0.03  # of a push from the free edge: a fingertip's width


@dataclass(frozen=True, slots=True, kw_only=True)
class Gripper:
    """A parallel gripper, lengths in m; small for its kind, so that few others reach more."""

    opening_m: float = 0.08  # Franka Hand and WSG-like strokes
    hand_m: tuple[float, float] = (0.04, 0.09)  # of the palm: along the grip, the way the fingers close
    finger_m: tuple[float, float, float] = (0.02, 0.005, 0.045)  # width, thickness, length before the palm
    hold_m: float = 0.02  # how deep the fingers reach over a grip
    back_off_m: float = 0.1  # free distance in front of a grip, for approach and opening


GRIPPER = Gripper()


def with_handles(plan: Plan) -> Plan:
    """The plan with the handles of all its joints, in the order of its bodies."""
    solids = solids_of(plan)
    found: list[Handle] = []
    for body in plan.bodies:
        with apart("export", f"{body.name}: its handles", {}):  # a front without a handle description still opens
            found += _handles(body, solids)
    return replace(plan, handles=tuple(found))


def out_of_reach(kind: HandleKind, grasp_width_m: float, room: Room) -> str | None:
    """Reason why the 9 cm gripper cannot grasp a handle, or None where it can."""
    hand = GRIPPER
    if room.before_m < hand.back_off_m:
        return f"{_mm(room.before_m)} mm are free before it, a hand needs {_mm(hand.back_off_m)} mm"
    if kind == "push":
        return None
    if grasp_width_m > hand.opening_m:
        return f"it is {_mm(grasp_width_m)} mm thick, the fingers open {_mm(hand.opening_m)} mm"
    if min(room.depth_m) < hand.hold_m / 2:
        return f"fingers reach {_mm(min(room.depth_m))} mm over it, {_mm(hand.hold_m / 2)} are needed"
    if min(room.beside_m) < hand.finger_m[1]:
        return f"{_mm(min(room.beside_m))} mm are free beside it, a finger is {_mm(hand.finger_m[1])} thick"
    return None


def _handles(body: Body, solids: Sequence[Solid]) -> Iterator[Handle]:
    joint = body.joint
    fronts = body.link.of_role("front")
    if joint is None or not fronts:
        return
    face = min(float(_corners(box)[:, 1].min()) for box in fronts)
    grips = _joined(body.link.of_role("handle"))
    if not grips:
        yield _push(body, joint, max(fronts, key=lambda box: float(box.size_m[0] * box.size_m[2])), solids)
    for number, pieces in enumerate(grips, start=1):
        name = f"{body.name}_handle" + (f"_{number}" if number > 1 else "")
        yield _grip(body, joint, name, pieces, face, solids)


def _grip(body: Body, joint: Joint, name: str, pieces: Sequence[Box], face: float, solids: Sequence[Solid]) -> Handle:
    """Grasp at the piece farthest out, with its longest side across the approach as x; a square knob is grasped sideways."""
    grip = min(pieces, key=lambda box: float(_corners(box)[:, 1].min()))
    corners = _corners(grip)
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = high - low
    upright = size[2] > size[0] - 1e-4
    turn = np.column_stack([_unit(2), _unit(0), _INTO]) if upright else np.column_stack([_unit(0), -_unit(2), _INTO])
    along, across = (size[2], size[0]) if upright else (size[0], size[2])
    gap = max(0.0, float(face - high[1]))
    pose = body.world_from_body @ Rigid3(turn, (low + high) / 2)
    extent = np.array([along, across, size[1]])
    return Handle(
        name=name,
        joint=body.joint_name,
        link=body.name,
        kind="bar" if gap > 1e-3 else "knob",
        world_from_handle=pose,
        opening_world=_opening(body, joint, (low + high) / 2),
        size_m=extent,
        protrusion_m=float(face - low[1]),
        gap_m=gap,
        room=_room_of(pose, extent, solids),
        sources=grip.sources,
        confidence=grip.confidence,
    )


def _push(body: Body, joint: Joint, front: Box, solids: Sequence[Solid]) -> Handle:
    """Push point a fingertip's width inside the front's free edge, half way along it; the middle of a sliding front."""
    corners = _corners(front)
    low, high = corners.min(axis=0), corners.max(axis=0)
    spot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    axis = np.asarray(body.axis_body)
    along = 2 if joint.type == "revolute" and abs(axis[2]) > 0.7 else 0
    if joint.type == "revolute":  # the link's frame lies on the hinge
        across = 0 if along == 2 else 2
        spot[across] = high[across] - _INSET_M if high[across] > -low[across] else low[across] + _INSET_M
    turn = np.column_stack([_unit(2), _unit(0), _INTO]) if along == 2 else np.column_stack([_unit(0), -_unit(2), _INTO])
    pose = body.world_from_body @ Rigid3(turn, spot)
    tip = GRIPPER.finger_m[0] / 2
    return Handle(
        name=f"{body.name}_push",
        joint=body.joint_name,
        link=body.name,
        kind="push",
        world_from_handle=pose,
        opening_world=_opening(body, joint, spot),
        size_m=np.array([float((high - low)[along]), 0.0, 0.0]),
        protrusion_m=0.0,
        gap_m=0.0,
        room=Room(before_m=_free(pose, (0, 0, 0), -_unit(2), (tip, tip), solids), beside_m=(0.0, 0.0), depth_m=(0.0, 0.0)),
    )


def _room_of(pose: Rigid3, size_m: Vector3, solids: Sequence[Solid]) -> Room:
    """Free space around the grip for a gripper approaching along z."""
    (wide, thick, long), outer, side = GRIPPER.finger_m, -size_m[2] / 2, size_m[1] / 2
    hold = GRIPPER.hold_m
    deep = [
        _free(pose, (0, sign * (side + 1e-3 + thick / 2), outer), _unit(2), (wide / 2, thick / 2), solids) for sign in (-1, 1)
    ]
    over = max(min(*deep, hold) - 1e-3, 1e-3)  # the fingers stop at the first contact
    beside = [
        _free(pose, (0, sign * side, outer + over / 2), sign * _unit(1), (wide / 2, over / 2), solids) for sign in (-1, 1)
    ]
    palm = (0, 0, outer + over - long)
    before = _free(pose, palm, -_unit(2), (GRIPPER.hand_m[0] / 2, GRIPPER.hand_m[1] / 2), solids)
    return Room(before_m=before, beside_m=(beside[0], beside[1]), depth_m=(deep[0], deep[1]))


def _free(pose: Rigid3, start: object, way: Vector3, half_m: tuple[float, float], solids: Sequence[Solid]) -> float:
    """Free travel in m of a rectangle from `start` along `way`, in the handle's frame; its first side is along x."""
    x = _unit(0)
    handle_from_prism = Rigid3(np.column_stack([x, np.cross(way, x), way]), np.asarray(start, dtype=np.float64))
    return free_length(Prism(world_from_prism=pose @ handle_from_prism, half_m=half_m, length_m=FAR_M), solids)


def _opening(body: Body, joint: Joint, spot: Vector3) -> Vector3:
    axis = np.asarray(body.axis_body)
    way = axis if joint.type == "prismatic" else np.cross(axis, spot)
    return np.asarray(body.world_from_body.turn(way / np.linalg.norm(way)))


def _joined(boxes: Sequence[Box]) -> list[list[Box]]:
    """Groups of touching boxes."""
    groups: list[list[Box]] = []
    for box in boxes:
        met = [group for group in groups if any(_touch(box, other) for other in group)]
        groups = [group for group in groups if group not in met] + [[*(b for group in met for b in group), box]]
    return groups


def _touch(a: Box, b: Box) -> bool:
    one, other = _corners(a), _corners(b)
    apart_m = np.maximum(one.min(axis=0) - other.max(axis=0), other.min(axis=0) - one.max(axis=0)).max()
    return bool(apart_m < _TOUCH_M)


def _corners(box: Box) -> np.ndarray:
    return box.link_from_box.apply(box_corners(box.size_m))


def _unit(axis: int) -> Vector3:
    return np.eye(3)[axis]


def _mm(metres: float) -> str:
    return f"{1000 * metres:.0f}"
