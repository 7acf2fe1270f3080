"""Commands for the gripper to open and close one joint by its handle, and measurements during execution."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import cv2
import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.robot.grasps import BACK_M, Way
from r2c2r_core.robot.motion import Hold, Travel
from r2c2r_core.robot.ramps import ramp, wait
from r2c2r_core.robot.rig import PREFIX, Rig

OPEN_SHARE = 0.9  # of the joint's travel
CLOSED_SHARE = 0.02
SPEED_M_S = 0.35  # of the handle
_TURN_RAD_S = 1.2
_APPROACH_S, _SETTLE_S, _SQUEEZE_S, _CROSS_S, _PATIENCE_S = 0.8, 0.15, 0.35, 1.2, 1.0
_BEYOND = 0.04  # overshoot of the commanded travel, to compensate for the base's springs
_LOST_M = 0.05  # distance between tool and handle at which the grip is lost, or the joint does not follow

Phase = Literal["approach", "squeeze", "open", "close", "release"]
Watch = Callable[[Rig], None]


class Command(NamedTuple):
    """One command of the gripper."""

    pose: Rigid3
    width_m: float
    phase: Phase


@dataclass(slots=True, kw_only=True)
class Measured:
    """Measurements of one attempt."""

    reach_m: float = float("nan")  # distance between the actual and the planned position of the closed pads
    opened: float = 0.0  # fraction of the travel
    closed: float = 1.0  # remaining fraction of the travel at the end
    slip_m: float = 0.0  # of the pads along the handle since closing
    force_n: float = 0.0  # maximum base force while moving the joint
    held: float = 0.0  # fraction of the time from squeeze to release with a pad in contact with the part
    touched: dict[int, float] = field(default_factory=dict)  # other bodies touched: body, maximum force in N
    jams: dict[int, float] = field(default_factory=dict)  # fixtures that the part meets as it opens: body, maximum force in N
    seconds: float = 0.0  # simulated


def attempt(rig: Rig, travel: Travel, way: Way, watch: Watch | None = None) -> Measured:
    """Open and close the joint from the rig's reset state; the scene is left in its final state."""
    measured, held_at, moving, contacts = Measured(), None, 0, 0
    first = way.presses or way.opens
    leaf, fixtures = _geoms_of(rig, travel.part.body), _fixtures(rig)
    rig.put(first.world_from_tool(travel, 0.0, BACK_M), first.wide_m)
    for command in commands(rig, travel, way):
        rig.command(command.pose, command.width_m)
        rig.step()
        measured.seconds += rig.step_s
        if watch is not None:
            watch(rig)
        share = travel.position(rig) / travel.upper
        touching = _touches(rig, travel.part.body, measured)
        if command.phase == "open":
            at = travel.world_from_body(travel.position(rig)).inverse.apply(rig.world_from_tool.translation)
            if held_at is None:
                held_at = at
                measured.reach_m = float(np.linalg.norm(at - way.opens.body_from_tool.translation))
            measured.slip_m = max(measured.slip_m, float(np.linalg.norm(at - held_at)))
            measured.opened = max(measured.opened, share)
            for pull in rig.contacts_of(leaf):
                if pull.body in fixtures:
                    measured.jams[pull.body] = max(measured.jams.get(pull.body, 0.0), pull.force_n)
        if command.phase in ("open", "close"):
            measured.force_n = max(measured.force_n, rig.base_force_n)
            moving, contacts = moving + 1, contacts + touching
        measured.closed = share
    measured.held = contacts / max(moving, 1)
    return measured


def commands(rig: Rig, travel: Travel, way: Way) -> Iterator[Command]:
    """Commands that open and close the joint, one per step; ends early where the part does not follow."""
    away = (OPEN_SHARE + _BEYOND) * travel.upper
    if way.presses is not None:
        yield from _approach(rig, travel, way.presses, 0.0)
        yield from _release(rig, travel, way.presses)
        rig.data.qpos[travel.address] = way.opens.starts  # simulates the push latch, which is not in the bundle
        yield from _cross(rig, way.opens.world_from_tool(travel, way.opens.starts, BACK_M))
    yield from _approach(rig, travel, way.opens, way.opens.starts)
    yield from wait(rig, Command(way.opens.world_from_tool(travel, way.opens.starts), 0.0, "squeeze"), _SQUEEZE_S)
    yield from _along(rig, travel, way.opens, "open", (way.opens.starts, away), OPEN_SHARE * travel.upper)
    last = way.opens
    if way.closes is not None:
        yield from _release(rig, travel, way.opens)
        last = way.closes
        yield from _cross(rig, last.world_from_tool(travel, travel.position(rig), BACK_M))
        yield from _approach(rig, travel, last, travel.position(rig))
    start = min(away, travel.position(rig) + _BEYOND * travel.upper)
    yield from _along(rig, travel, last, "close", (start, -_BEYOND / 2 * travel.upper), CLOSED_SHARE * travel.upper)
    yield from _release(rig, travel, last)


def _approach(rig: Rig, travel: Travel, hold: Hold, position: float) -> Iterator[Command]:
    for share in ramp(rig, _APPROACH_S):
        yield Command(hold.world_from_tool(travel, position, (1 - share) * BACK_M), hold.wide_m, "approach")
    yield from wait(rig, Command(hold.world_from_tool(travel, position), hold.wide_m, "approach"), _SETTLE_S)


def _along(rig: Rig, travel: Travel, hold: Hold, phase: Phase, ends: tuple[float, float], enough: float) -> Iterator[Command]:
    """Commands along the joint's travel from one end until past `enough`, with a short wait there."""
    sign = np.sign(ends[1] - ends[0])
    for share in ramp(rig, _seconds(travel, hold)):
        yield Command(hold.world_from_tool(travel, ends[0] + share * (ends[1] - ends[0])), 0.0, phase)
        if _lost(rig, travel, hold):
            return
        if sign * (travel.position(rig) - enough) >= 0:
            return
    for _ in range(round(_PATIENCE_S / rig.step_s)):
        yield Command(hold.world_from_tool(travel, ends[1]), 0.0, phase)
        if sign * (travel.position(rig) - enough) >= 0:
            return


def _release(rig: Rig, travel: Travel, hold: Hold) -> Iterator[Command]:
    """Commands that open the fingers in place, then retract."""
    at = travel.position(rig)
    yield from wait(rig, Command(hold.world_from_tool(travel, at), hold.wide_m, "release"), _SQUEEZE_S)
    for share in ramp(rig, _APPROACH_S):
        yield Command(hold.world_from_tool(travel, at, share * BACK_M), hold.wide_m, "release")


def _cross(rig: Rig, target: Rigid3) -> Iterator[Command]:
    """Commands along a straight line to another pose, with interpolated rotation."""
    start = rig.world_from_tool
    turn = np.asarray(cv2.Rodrigues(target.rotation @ start.rotation.T)[0]).ravel()
    for share in ramp(rig, _CROSS_S):
        rotation = np.asarray(cv2.Rodrigues(share * turn)[0]) @ start.rotation
        yield Command(Rigid3(rotation, start.translation + share * (target.translation - start.translation)), 0.0, "approach")


def _seconds(travel: Travel, hold: Hold) -> float:
    radius = travel.radius_of(hold.body_from_tool.translation)
    speed = min(SPEED_M_S / max(radius, 1e-3), _TURN_RAD_S) if travel.hinged else SPEED_M_S
    return max(1.5 * travel.upper / speed, 0.5)  # the ramp is 1.5 times as fast in its middle


def _lost(rig: Rig, travel: Travel, hold: Hold) -> bool:
    handle = travel.world_from_body(travel.position(rig)).apply(hold.body_from_tool.translation)
    return bool(np.linalg.norm(rig.world_from_tool.translation - handle) > _LOST_M)


def _touches(rig: Rig, part: int, measured: Measured) -> bool:
    """Whether a pad touches the part; records contacts with other bodies."""
    touching = False
    for pull in rig.pulls():
        if pull.body == part:
            touching = touching or pull.geom in rig.pads
        else:
            measured.touched[pull.body] = max(measured.touched.get(pull.body, 0.0), pull.force_n)
    return touching


def _geoms_of(rig: Rig, body: int) -> frozenset[int]:
    return frozenset(np.flatnonzero(rig.model.geom_bodyid == body).tolist())


def _fixtures(rig: Rig) -> frozenset[int]:
    """Bodies that neither move freely nor belong to the robot."""
    robot = {int(rig.model.geom_bodyid[geom]) for geom in rig.own}
    return frozenset(body for body in range(rig.model.nbody) if rig.model.body_dofnum[body] < 6 and body not in robot)


def reset(rig: Rig) -> None:
    """Reset the simulation to the scene's initial state at time zero."""
    import mujoco

    mujoco.mj_resetData(rig.model, rig.data)
    mujoco.mj_forward(rig.model, rig.data)


def joints_of(model: Any) -> list[str]:
    """Names of the scene's hinges and slides with a non-empty range."""
    names = [model.joint(j).name for j in range(model.njnt) if model.jnt_type[j] in (2, 3)]
    return [n for n in names if not n.startswith(PREFIX) and model.joint(n).range[1] > model.joint(n).range[0]]
