"""Grasp candidates for handles and push contacts for fronts without one, with collision checks along the motion."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3, rotation_about
from r2c2r_core.robot.handles import Board, Part
from r2c2r_core.robot.motion import Hold, Travel
from r2c2r_core.robot.rig import HALF_PAD_M, STROKE_M, TIP_M, Rig, find_contacts, tool_rotation

BACK_M = 0.12  # distance from the handle at which an approach begins
MARGIN_M = 0.002  # minimum clearance between the handle and each finger
_BESIDE_M = 0.012  # clearance to the handle during the approach, where the stroke allows it
_BEHIND_M = 0.006  # reach of the tips past the bar, where there is space
_OFF_FRONT_M = 0.002  # clearance between tips and front, at most a quarter of the protrusion
EJECTED_M = 0.04  # own choice: commercial push latches eject a front by 14 to 40 mm
_HOOK_M = 0.01  # depth of the fingertip behind an edge
_INSET_M = 0.03  # distance from the edge at which a front is pressed and pushed
_PRESS_M = 0.006  # target depth behind the face, at which the base's springs press with about 20 N
_TOUCH_M = 0.001  # minimum overlap that counts
_INTO = np.array([0.0, 1.0, 0.0])  # the front's inward normal, in its body
_SHARES = (0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9)  # fractions of the travel that are checked beforehand


Method = Literal["pinch", "side", "drag", "push"]
"""Of opening: the pads on both faces of a handle; a fingertip against one side of a sliding door's; a fingertip on the face of
a sliding door; a front without a handle pressed until its latch throws it out, and pulled by its edge."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Way:
    """A plan to open and close a joint, with expected collisions: body and depth in metres."""

    method: Method
    opens: Hold
    closes: Hold | None = None  # None: the same hold, without releasing
    presses: Hold | None = None  # push before opening
    clashes: dict[int, float] = field(default_factory=dict)

    @property
    def worst_m(self) -> float:
        """Deepest expected overlap, in metres."""
        return max(self.clashes.values(), default=0.0)


def holdable(bar: Board) -> tuple[int, ...]:
    """Sides of the bar (0 across, 2 upright) that fit between the fingers, the narrower first."""
    sides = sorted((0, 2), key=lambda side: float(bar.size[side]))
    return tuple(side for side in sides if bar.size[side] <= STROKE_M - 2 * MARGIN_M)


def best_way(rig: Rig, travel: Travel) -> Way | None:
    """The plan with the least collision, preferring pinches; None where the handle does not fit between the fingers."""
    best: Way | None = None
    for way in _ways(travel):
        tried = replace(way, clashes=clashes(rig, travel, way))
        if best is None or tried.worst_m < best.worst_m - 1e-4:
            best = tried
        if not best.clashes:
            break
    return best


def clear_ways(rig: Rig, travel: Travel) -> Iterator[Way]:
    """Collision-free plans, one per wrist rotation, in the order of `best_way`."""
    known: set[bytes] = set()
    for way in _ways(travel):
        turn = np.append(way.opens.body_from_tool.rotation.round(3), way.opens.follow).tobytes() + way.method.encode()
        if turn not in known and not clashes(rig, travel, way):
            known.add(turn)
            yield way


def clashes(rig: Rig, travel: Travel, way: Way) -> dict[int, float]:
    """Collisions of the gripper on the approach and along 90 % of the joint's travel, without the grasp itself."""
    import mujoco

    scratch = mujoco.MjData(rig.model)
    scratch.qpos[:] = rig.data.qpos
    found: dict[int, float] = {}
    for pose, width, position in stations(travel, way):
        probe = replace(rig, data=scratch)
        probe.put(pose, width)
        scratch.qpos[travel.address] = position
        find_contacts(rig.model, scratch)
        for body, depth_m in overlaps(probe, travel.part.body):
            found[body] = max(found.get(body, 0.0), depth_m)
    return found


STATIONS_OF_A_LEG = 3 + len(_SHARES)


def stations(travel: Travel, way: Way) -> Iterator[tuple[Rigid3, float, float]]:
    """Checked configurations of each hold (pose, width, joint position): along the approach, then along the joint's travel."""
    start, end = way.opens.starts, _SHARES[-1] * travel.upper
    legs = [(way.opens, start), *([(way.closes, end)] if way.closes is not None else [])]
    for hold, at in legs:
        for back_m in (BACK_M, BACK_M / 2, 0.0):
            yield hold.world_from_tool(travel, at, back_m), hold.wide_m, at
        for share in _SHARES:
            position = max(share * travel.upper, hold.starts)
            yield hold.world_from_tool(travel, position), hold.held_m, position


def overlaps(rig: Rig, held: int) -> Iterator[tuple[int, float]]:
    """Bodies that the robot overlaps now, with depth, except its pads on the grasped part.

    Robot geoms with a gap count as touching from that distance.
    """
    model, contacts = rig.model, rig.data.contact
    for number, (a, b) in enumerate(contacts.geom[: rig.data.ncon]):
        if (a in rig.own) == (b in rig.own):
            continue
        mine, other = (a, b) if a in rig.own else (b, a)
        body, depth_m = int(model.geom_bodyid[other]), float(model.geom_gap[mine] - contacts.dist[number])
        if depth_m > _TOUCH_M and not (body == held and mine in rig.pads):
            yield body, depth_m


def _ways(travel: Travel) -> Iterator[Way]:
    part = travel.part
    if part.bar is not None:
        yield from (Way(method="pinch", opens=hold) for hold in _pinches(travel, part.bar))
    along = _slides_along(travel)
    if along is not None:
        if part.bar is not None:
            yield _beside(travel, part.bar, along)
        for inset_m in (_INSET_M, _INSET_M / 2):
            for up in (0.0, -0.25, 0.25):  # the part that passes in front may have a handle
                yield Way(method="drag", opens=_on_face(travel, -along, inset_m, press_m=_PRESS_M, up=up))
    elif part.bar is None:
        yield from (_pushed(travel, edge) for edge in _edges(travel))


def _pinches(travel: Travel, bar: Board) -> Iterator[Hold]:
    """Grasp candidates, simplest first: the bar's middle, then towards its ends, with less clearance, tilted."""
    for tilt in (0.0, 0.5, -0.5):
        for beside_m in (_BESIDE_M, MARGIN_M):
            for side in holdable(bar):
                turns_in_grip = travel.hinged and abs(_axis_body(travel)[side]) > 0.99
                for follow in (1.0, 0.5, 0.0) if turns_in_grip else (1.0,):
                    for along in (0.0, 0.25, -0.25):
                        yield _pinch(travel.part, bar, side, along, tilt, beside_m, follow)


def _pinch(part: Part, bar: Board, side: int, along: float, tilt: float, beside_m: float, follow: float) -> Hold:
    """Pinch with pads on both faces of the bar's `side`, and the tips just past the bar, clear of the front."""
    off_front = min(_OFF_FRONT_M, part.protrusion_m / 4) + HALF_PAD_M * abs(np.sin(tilt))
    tip = min(part.front.low[1] - off_front, bar.high[1] + _BEHIND_M)
    place = bar.centre
    place[1] = tip
    place[2 - side] += along * bar.size[2 - side]
    stroke = np.eye(3)[side] * (-1.0 if side == 0 else 1.0)  # to the left when looking along the approach, or up
    approach = rotation_about(stroke, tilt) @ _INTO
    width = float(bar.size[side])
    return Hold(
        body_from_tool=Rigid3(tool_rotation(approach, stroke), place - TIP_M * approach),
        wide_m=min(width + 2 * beside_m, STROKE_M),
        held_m=width,
        follow=follow,
    )


def _beside(travel: Travel, bar: Board, along: Vector3) -> Way:
    """Push of a sliding door by its handle: fingertip on the trailing side to open, on the leading side to close."""
    off = float(np.abs(along) @ bar.size) / 2 + HALF_PAD_M + _OFF_FRONT_M / 4
    tip = min(travel.part.front.low[1] - min(_OFF_FRONT_M, travel.part.protrusion_m / 4), bar.high[1] + _BEHIND_M)
    place = np.array([bar.centre[0], tip - TIP_M, bar.centre[2]])
    turned = tool_rotation(_INTO, np.cross(_INTO, along))  # its narrower side along the motion
    opens, closes = (
        Hold(body_from_tool=Rigid3(turned, place + sign * off * along), wide_m=0.0, held_m=0.0) for sign in (-1.0, 1.0)
    )
    return Way(method="side", opens=opens, closes=closes)


def _pushed(travel: Travel, edge: Vector3) -> Way:
    """Plan for a push latch: press the face near an edge, pull the ejected edge from behind, push the face shut."""
    front = travel.part.front
    middle = front.centre + np.abs(edge) * front.size / 2 * edge
    thrown = EJECTED_M / max(travel.radius_of(middle), 1e-3)
    approach = (_INTO - edge) / np.sqrt(2.0)
    away = (_INTO + edge) / np.sqrt(2.0)
    corner = np.where(_INTO > 0, front.high, middle)
    tip = corner + (HALF_PAD_M + _OFF_FRONT_M) * away + _HOOK_M * approach
    hook = Hold(
        body_from_tool=Rigid3(tool_rotation(approach, np.cross(edge, _INTO)), tip - TIP_M * approach),
        wide_m=0.0,
        held_m=0.0,
        starts=min(thrown, travel.upper / 2),
    )
    pushes, presses = (_on_face(travel, edge, _INSET_M, press_m) for press_m in (0.0, _PRESS_M))
    return Way(method="push", opens=hook, closes=pushes, presses=presses)


def _on_face(travel: Travel, edge: Vector3, inset_m: float, press_m: float, up: float = 0.0) -> Hold:
    """Contact of the closed fingertips on the face, `inset_m` from an edge, at fraction `up` of its length from its middle.

    The target is `press_m` behind the face, so that the base's springs press.
    """
    front = travel.part.front
    place = front.centre + (np.abs(edge) @ front.size / 2 - inset_m) * edge
    place += up * np.abs(np.cross(edge, _INTO)) * front.size
    place[1] = front.low[1] + press_m - TIP_M
    return Hold(body_from_tool=Rigid3(tool_rotation(_INTO, np.cross(_INTO, edge)), place), wide_m=0.0, held_m=0.0)


def _edges(travel: Travel) -> Iterable[Vector3]:
    """Outward directions, in the body, of edges to pull: a door's free edge, or all edges of a drawer, the top first."""
    across, up = np.eye(3)[0], np.eye(3)[2]
    if not travel.hinged:
        return (up, across, -across, -up)
    arm = travel.part.front.centre - travel.world_from_closed.inverse.apply(travel.anchor)
    arm -= (arm @ _axis_body(travel)) * _axis_body(travel)
    side = 0 if abs(arm[0]) > abs(arm[2]) else 2
    return (np.eye(3)[side] * np.sign(arm[side]),)


def _slides_along(travel: Travel) -> Vector3 | None:
    """Opening direction, in the body, of a sliding door within its own plane; None if it opens outwards."""
    axis = _axis_body(travel)
    if travel.hinged or abs(axis[1]) > 0.7:
        return None
    side = 0 if abs(axis[0]) > abs(axis[2]) else 2
    return np.asarray(np.eye(3)[side] * np.sign(axis[side]))


def _axis_body(travel: Travel) -> Vector3:
    return np.asarray(travel.world_from_closed.rotation.T @ travel.axis)


def body_words(model: Any, body: int) -> str:
    """Readable name of a body."""
    return "the floor or a wall" if body == 0 else str(model.body(body).name)
