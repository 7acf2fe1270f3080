"""Pick and place of a free-standing object with the gripper, over 10 cm."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.robot.grasps import BACK_M, MARGIN_M
from r2c2r_core.robot.opening import Watch
from r2c2r_core.robot.ramps import approach_from, ramp, wait
from r2c2r_core.robot.rig import HALF_PAD_M, STROKE_M, TIP_M, Rig, find_contacts, tool_rotation

FURTHER_M = 0.10
NEAR_M = 0.03  # maximum distance from the goal for success
_UPRIGHT = np.cos(np.deg2rad(15.0))
_LIFT_M = 0.06
_DEEP_M = 0.035  # maximum depth of an object between the fingers
_HEIGHTS = (0.5, 0.75, 0.9)  # fractions of the object's height for grasps from the side; the last holds a bottle's neck
_UP = np.array([0.0, 0.0, 1.0])
_TURNS = np.deg2rad(np.arange(0.0, 360.0, 30.0))
_TILTS = (0.0, 0.5, np.pi / 2)  # rad below the horizontal
_TOUCH_M = 0.001
_NEAR_PADS_M = 0.025  # behind the pads' middle: the part of an object grasped from above that determines its width
_ON_EDGE = np.linspace(0.0, 1.0, 33)[:, None]  # sample positions along each edge of a collider


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pick:
    """A planned grasp and placement of an object."""

    body: int
    grasp: Rigid3  # world_from_tool when the pads close
    shift: Vector3  # to its new place
    wide_m: float
    held_m: float
    address: int  # of its free joint in qpos


class Put(NamedTuple):
    """Result of a pick and place."""

    lifted_m: float
    off_m: float  # from its goal
    upright: float  # cosine of its tilt

    @property
    def done(self) -> bool:
        """Whether the object was lifted and stands upright at its goal."""
        return bool(self.lifted and self.off_m < NEAR_M and self.upright > _UPRIGHT)

    @property
    def lifted(self) -> bool:
        """Whether the object left its support."""
        return self.lifted_m > _LIFT_M / 2


def things_of(model: Any) -> list[int]:
    """Bodies with a free joint."""
    return [int(model.jnt_bodyid[j]) for j in range(model.njnt) if model.jnt_type[j] == 0]


def plan_pick(rig: Rig, body: int) -> Pick | str:
    """The first collision-free grasp and placement, or the reason why there is none."""
    shifts = list(_free_places(rig, body))
    if not shifts:
        return "no free place 10 cm further on its support"
    narrow = False
    for pick in _grasps(rig, body):
        narrow = True
        if not _in_the_way(rig, pick):
            for shift in shifts:
                if not _in_the_way(rig, placed := replace(pick, shift=shift)):
                    return placed
    return "blocked: no collision-free way" if narrow else f"wider than {1000 * (STROKE_M - 2 * MARGIN_M):.0f} mm all round"


def pick_and_place(rig: Rig, pick: Pick, watch: Watch | None = None) -> Put:
    """Execute a pick and place from the rig's reset state."""
    start, highest = rig.world_from_body(pick.body), 0.0
    rig.put(_back(pick.grasp, BACK_M), pick.wide_m)
    for pose, width in commands(rig, pick):
        rig.command(pose, width)
        rig.step()
        highest = max(highest, float(rig.data.xpos[pick.body][2] - start.translation[2]))
        if watch is not None:
            watch(rig)
    end = rig.world_from_body(pick.body)
    upright = float((end.rotation @ start.rotation.T @ _UP)[2])
    return Put(highest, float(np.linalg.norm(end.translation - start.translation - pick.shift)), upright)


def commands(rig: Rig, pick: Pick) -> Iterator[tuple[Rigid3, float]]:
    """Tool poses and widths: approach, grasp, lift, move across, lower, release, retract, wait."""
    above, over, there = (
        Rigid3(pick.grasp.rotation, pick.grasp.translation + shift)
        for shift in (_LIFT_M * _UP, _LIFT_M * _UP + pick.shift, pick.shift)
    )
    for pose in approach_from(rig, pick.grasp, BACK_M):
        yield pose, pick.wide_m
    yield from wait(rig, (pick.grasp, 0.0), 0.5)
    for start, end in ((pick.grasp, above), (above, over), (over, there)):
        for share in ramp(rig, 0.8):
            yield Rigid3(start.rotation, start.translation + share * (end.translation - start.translation)), 0.0
    yield from wait(rig, (there, 0.0), 0.2)
    yield from wait(rig, (there, pick.wide_m), 0.4)
    for share in ramp(rig, 0.8):
        yield _back(there, share * BACK_M), pick.wide_m
    yield from wait(rig, (_back(there, BACK_M), pick.wide_m), 0.4)


def _grasps(rig: Rig, body: int) -> Iterator[Pick]:
    """Grasps that fit the stroke, not moved yet: from each side at several heights, then from above."""
    points = _points_world(rig, body)
    for tilt in _TILTS:
        for height in _HEIGHTS if tilt < 1.0 else (0.5,):
            for turn in _TURNS:
                if (found := _grasp(points, tilt, height, turn)) is not None:
                    yield Pick(
                        body=body,
                        grasp=found[0],
                        shift=np.zeros(3),
                        wide_m=STROKE_M,
                        held_m=found[1],
                        address=int(rig.model.jnt_qposadr[rig.model.body_jntadr[body]]),
                    )


def _grasp(points: Points, tilt: float, height: float, turn: float) -> tuple[Rigid3, float] | None:
    """Tool pose and width of a grasp of the object's section between the fingers; None where it is too wide."""
    level = np.array([np.cos(turn), np.sin(turn), 0.0])
    stroke = np.cross(_UP, level)
    approach = np.cos(tilt) * level - np.sin(tilt) * _UP
    over = np.cross(approach, stroke)
    deep, across, up = points @ approach, points @ stroke, points @ over
    at = up.min() + height * np.ptp(up)
    if tilt < 1.0:
        held = np.abs(up - at) < HALF_PAD_M
        reach = deep[held].min() + np.ptp(deep[held]) / 2 if held.any() else 0.0
    else:
        reach = deep.min() + min(float(np.ptp(deep)) / 2, _DEEP_M - TIP_M)
        held = deep < reach + _NEAR_PADS_M
    if not held.any() or np.ptp(across[held]) > STROKE_M - 2 * MARGIN_M:
        return None
    middle = (across[held].min() + across[held].max()) / 2
    return Rigid3(tool_rotation(approach, stroke), reach * approach + middle * stroke + at * over), float(np.ptp(across[held]))


def _free_places(rig: Rig, body: int) -> Iterator[Vector3]:
    """Shifts after which the object stands on its support without touching anything else."""
    import mujoco

    model, points = rig.model, _points_world(rig, body)
    foot = points[points[:, 2] < points[:, 2].min() + 0.01]
    address = model.jnt_qposadr[model.body_jntadr[body]]
    scratch = mujoco.MjData(model)
    for turn in _TURNS:
        shift = FURTHER_M * np.array([np.cos(turn), np.sin(turn), 0.0])
        scratch.qpos[:] = rig.data.qpos
        scratch.qpos[address : address + 3] += shift + 0.004 * _UP
        find_contacts(model, scratch)
        met = {
            int(b)
            for pair in scratch.contact.geom[: scratch.ncon]
            for b in model.geom_bodyid[pair]
            if body in model.geom_bodyid[pair]
        }
        if not met and all(_stands(model, scratch, point + shift, body) for point in foot[:: max(len(foot) // 8, 1)]):
            yield shift


def _stands(model: Any, data: Any, point: Vector3, body: int) -> bool:
    """Whether the floor or a collider lies just below a point."""
    import mujoco

    hit = np.zeros(1, np.int32)
    groups = np.array([0, 1, 0, 1, 0, 0], np.uint8)  # the floor and colliders
    away = mujoco.mj_ray(model, data, point + 0.02 * _UP, -_UP, groups, 1, body, hit, None)
    return 0 <= away < 0.03


def _in_the_way(rig: Rig, pick: Pick) -> bool:
    """Whether the gripper overlaps anything but the object along its approach, with the object at its shifted place."""
    import mujoco

    scratch = mujoco.MjData(rig.model)
    probe = replace(rig, data=scratch)
    for back_m in (BACK_M, BACK_M / 2, 0.0):
        scratch.qpos[:] = rig.data.qpos
        scratch.qpos[pick.address : pick.address + 3] += pick.shift
        pose = _back(pick.grasp, back_m)
        probe.put(Rigid3(pose.rotation, pose.translation + pick.shift), pick.wide_m)
        find_contacts(rig.model, scratch)
        for number, (a, b) in enumerate(scratch.contact.geom[: scratch.ncon]):
            if (a in rig.own) != (b in rig.own) and scratch.contact.dist[number] < -_TOUCH_M:
                return True
    return False


def _points_world(rig: Rig, body: int) -> Points:
    """Points along the edges of the object's colliders, in the world."""
    model, data = rig.model, rig.data
    find_contacts(model, data)
    found = []
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom] != body or not model.geom_contype[geom]:
            continue
        mesh = int(model.geom_dataid[geom])
        if mesh >= 0:
            first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
            vertices = model.mesh_vert[model.mesh_vertadr[mesh] + model.mesh_face[first : first + count]]
            ends = np.stack([vertices, np.roll(vertices, 1, axis=1)], axis=2).reshape(-1, 2, 3)
        else:
            pairs = [(a, a | bit) for a in range(8) for bit in (1, 2, 4) if not a & bit]
            ends = (model.geom_aabb[geom][:3] + box_corners(2 * model.geom_aabb[geom][3:]))[pairs]
        local = (ends[:, :1] + _ON_EDGE * (ends[:, 1:] - ends[:, :1])).reshape(-1, 3)
        found.append(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return np.concatenate(found)


def _back(pose: Rigid3, metres: float) -> Rigid3:
    return Rigid3(pose.rotation, pose.translation - metres * pose.rotation[:, 0])
