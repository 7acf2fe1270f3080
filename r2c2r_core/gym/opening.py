"""Environment r2c2r/Open-v0: open one joint."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import BundleError
from r2c2r_core.export.contacts import movers_of
from r2c2r_core.gym.robot_env import RobotEnv, tool_state
from r2c2r_core.robot.grasps import BACK_M, Way, best_way
from r2c2r_core.robot.motion import Travel, travel_of
from r2c2r_core.robot.opening import OPEN_SHARE, joints_of
from r2c2r_core.robot.rig import Rig, find_contacts

STATE = 20
_LOOKS = 21  # along the joint's travel


class OpenEnv(RobotEnv):
    """Environment of opening a joint to 90 % of its travel; a front without a handle starts ejected by its push latch.

    State (20): the tool in the frame of its grasp on the part (3, m), the approach and stroke axes of that grasp in the world
    (6), of the tool (6), width in strokes, fraction opened, its speed per second, whether a pad touches the part, force of the
    base in 100 N. Reward: 5 times the fraction gained, and the metres by which the tool approached its grasp; 1 at success.
    """

    def __init__(self, bundle: str | Path, joint: str, **options: Any) -> None:
        self.joint = joint
        super().__init__(bundle, STATE, **options)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset to a scene with this joint and those in its way closed; all others as in the scene."""
        self.begin(seed, options)
        opens = self.way.opens
        self.rig.data.qpos[self.travel.address] = opens.starts
        self.put_before(opens.world_from_tool(self.travel, opens.starts), 2 * BACK_M)
        self._before = self._progress()
        return self.observed(self._state()), self._info()

    def prepare(self) -> str | None:
        """Close the joint and plan how to open it."""
        rig = self.rig
        if self.joint not in joints_of(rig.model):
            raise BundleError(f"joint {self.joint}: no such joint", hint=f"choose one of: {', '.join(joints_of(rig.model))}")
        travel = travel_of(rig, self.joint)
        if travel is None:
            return f"joint {self.joint} moves no flat board"
        rig.data.qpos[travel.address] = 0.0
        close_in_the_way(rig, travel)
        way = best_way(rig, travel)
        if way is None:
            return f"joint {self.joint} cannot be grasped or pushed"
        self.travel: Travel = travel
        self.way: Way = replace(way, presses=None)
        return None

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """0.05 s."""
        self.move(action)
        now, before = self._progress(), self._before
        self._before = now
        done = now[0] >= OPEN_SHARE
        reward = 5.0 * (now[0] - before[0]) + (before[1] - now[1]) + float(done)
        return self.observed(self._state()), float(reward), done, False, self._info()

    def view(self) -> tuple[Vector3, Vector3]:
        """Camera target: the front's centre, and its outward direction."""
        pose = self.travel.world_from_closed
        return pose.apply(self.travel.part.front.centre), -pose.rotation[:, 1]

    def _progress(self) -> tuple[float, float]:
        """Fraction opened, and distance in metres to the grasp."""
        position = self.travel.position(self.rig)
        goal = self.way.opens.world_from_tool(self.travel, position).translation
        return position / self.travel.upper, float(np.linalg.norm(goal - self.rig.world_from_tool.translation))

    def _state(self) -> np.ndarray:
        rig, travel = self.rig, self.travel
        goal = self.way.opens.world_from_tool(travel, travel.position(rig))
        inside = goal.inverse.apply(rig.world_from_tool.translation)
        speed = float(rig.data.qvel[rig.model.joint(self.joint).dofadr[0]]) / travel.upper
        touching = any(pull.body == travel.part.body and pull.geom in rig.pads for pull in rig.pulls())
        share = travel.position(rig) / travel.upper
        rest = [share, speed, float(touching), rig.base_force_n / 100]
        return np.array([*inside, *goal.rotation[:, 0], *goal.rotation[:, 1], *tool_state(rig), *rest])

    def _info(self) -> dict[str, Any]:
        share, away_m = self._progress()
        return {"opened": share, "to_grasp_m": away_m, "success": share >= OPEN_SHARE, "method": self.way.method}


def close_in_the_way(rig: Rig, travel: Travel) -> None:
    """Close the joints whose parts, being ajar, would block the part."""
    import mujoco

    scratch, model, own = mujoco.MjData(rig.model), rig.model, travel.part.joint
    moving = {body: name for name in joints_of(model) for body in movers_of(model, name)}
    for share in np.linspace(0.0, 1.0, _LOOKS):
        scratch.qpos[:] = rig.data.qpos
        scratch.qpos[travel.address] = share * travel.upper
        find_contacts(model, scratch)
        for pair in scratch.contact.geom[: scratch.ncon]:
            joints = {moving.get(int(model.geom_bodyid[geom])) for geom in pair}
            for other in joints - {own, None} if own in joints else ():
                rig.data.qpos[model.joint(other).qposadr[0]] = 0.0
