"""Scripted policy for both environments: the commands of the gripper's certificate, as actions."""

from collections.abc import Iterator
from itertools import islice

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.gym.opening import OpenEnv
from r2c2r_core.gym.placing import PickPlaceEnv
from r2c2r_core.gym.robot_env import TICKS, RobotEnv
from r2c2r_core.robot import opening, picking
from r2c2r_core.robot.grasps import BACK_M

_NEAR_M = 0.01
_MOST_STEPS = 60  # to the pose from which the commands start


def scripted_actions(env: RobotEnv) -> Iterator[np.ndarray]:
    """Actions, one per step, from the state of `env` after a reset; `env` is the unwrapped environment."""
    if isinstance(env, OpenEnv):
        start = env.way.opens.world_from_tool(env.travel, env.way.opens.starts, BACK_M)
        wide_m = env.way.opens.wide_m
        plan: Iterator[tuple[Rigid3, float]] = (
            (command.pose, command.width_m) for command in opening.commands(env.rig, env.travel, env.way)
        )
    elif isinstance(env, PickPlaceEnv):
        grasp = env.pick.grasp
        start = Rigid3(grasp.rotation, grasp.translation - BACK_M * grasp.rotation[:, 0])
        wide_m = env.pick.wide_m
        plan = picking.commands(env.rig, env.pick)
    else:
        raise TypeError(type(env).__name__)
    for _ in range(_MOST_STEPS):
        if float(np.linalg.norm(env.rig.world_from_tool.translation - start.translation)) < _NEAR_M:
            break
        yield env.action_to(start, wide_m)
    while ticks := list(islice(plan, TICKS)):
        yield env.action_to(*ticks[-1])
