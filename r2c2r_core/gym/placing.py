"""Environment r2c2r/PickPlace-v0: pick up one object and put it down 10 cm further."""

from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import BundleError
from r2c2r_core.gym.robot_env import RobotEnv, tool_state
from r2c2r_core.robot.certificate import level
from r2c2r_core.robot.grasps import BACK_M, body_words
from r2c2r_core.robot.picking import NEAR_M, Pick, plan_pick, things_of

STATE = 20
_UPRIGHT = np.cos(np.deg2rad(15.0))
_REST_M_S = 0.02


class PickPlaceEnv(RobotEnv):
    """Environment of moving an object to a goal; success if it was lifted, then released upright at rest within 3 cm of it.

    State (20): the tool relative to its grasp at the object's current position (3, m), the object relative to its goal (3), its
    up axis (3), its velocity (3), the tool's axes (6) and width in strokes, the maximum lift (m). Reward: metres by which the
    tool approached its grasp, 5 times those by which the object approached its goal; 1 at success.
    """

    def __init__(self, bundle: str | Path, thing: str, **options: Any) -> None:
        self.thing = thing
        super().__init__(bundle, STATE, **options)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset to a scene with a goal 10 cm beside the object."""
        self.begin(seed, options)
        self._start = self.rig.data.xpos[self.pick.body].copy()
        self._lifted_m = 0.0
        self.put_before(self.pick.grasp, 1.5 * BACK_M)
        self._before = self._distances()
        return self.observed(self._state()), self._info()

    def prepare(self) -> str | None:
        """Plan how to pick the object up and where to put it."""
        import mujoco

        rig = self.rig
        mujoco.mj_forward(rig.model, rig.data)
        things = {body_words(rig.model, body): body for body in things_of(rig.model)}
        body = next((b for name, b in things.items() if name == self.thing or name.startswith(f"{self.thing}_")), None)
        if body is None:
            raise BundleError(f"thing {self.thing}: no such object", hint=f"free objects: {', '.join(things) or 'none'}")
        pick = plan_pick(rig, body)
        if isinstance(pick, str):
            return f"thing {self.thing}: {pick}"
        self.pick: Pick = pick
        return None

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """0.05 s."""
        self.move(action)
        self._lifted_m = max(self._lifted_m, float(self._at[2] - self._start[2]))
        now, before = self._distances(), self._before
        self._before = now
        done = self._success()
        reward = (before[0] - now[0]) + 5.0 * (before[1] - now[1]) + float(done)
        return self.observed(self._state()), float(reward), done, False, self._info()

    def view(self) -> tuple[Vector3, Vector3]:
        """Camera target: the object's initial position, seen from the gripper's approach side."""
        return self._start, level(-self.pick.grasp.rotation[:, 0])

    @property
    def _at(self) -> Vector3:
        return np.asarray(self.rig.data.xpos[self.pick.body])

    def _distances(self) -> tuple[float, float]:
        """Distance in metres of the tool from the grasp, and of the object from its goal."""
        tool = self.rig.world_from_tool.translation - (self.pick.grasp.translation + self._at - self._start)
        return float(np.linalg.norm(tool)), float(np.linalg.norm(self._at - self._start - self.pick.shift))

    def _velocity(self) -> np.ndarray:
        first = int(self.rig.model.jnt_dofadr[self.rig.model.body_jntadr[self.pick.body]])
        return np.asarray(self.rig.data.qvel[first : first + 3])

    def _up(self) -> np.ndarray:
        return np.asarray(self.rig.data.xmat[self.pick.body].reshape(3, 3)[:, 2])

    def _success(self) -> bool:
        there = self._distances()[1] < NEAR_M and self._up()[2] > _UPRIGHT and self._lifted_m > NEAR_M / 2
        still = float(np.linalg.norm(self._velocity())) < _REST_M_S
        return bool(there and still and not any(pull.body == self.pick.body for pull in self.rig.pulls()))

    def _state(self) -> np.ndarray:
        tool = self.rig.world_from_tool.translation - (self.pick.grasp.translation + self._at - self._start)
        off = self._at - self._start - self.pick.shift
        return np.array([*tool, *off, *self._up(), *self._velocity(), *tool_state(self.rig), self._lifted_m])

    def _info(self) -> dict[str, Any]:
        to_grasp_m, to_goal_m = self._distances()
        return {"to_grasp_m": to_grasp_m, "to_goal_m": to_goal_m, "lifted_m": self._lifted_m, "success": self._success()}
