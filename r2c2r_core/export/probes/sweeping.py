"""Comparison sweep of every joint in an engine for MuJoCo models and in MuJoCo. Imports nothing from r2c2r."""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

HELD = (
    *("jnt_range", "jnt_axis", "jnt_pos", "jnt_actfrcrange", "dof_damping", "dof_frictionloss"),
    *("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat", "geom_contype", "geom_conaffinity"),
)
"""The arrays of a model that an engine's copy is read back from."""

Stepped = np.ndarray
"""Generalised positions."""

_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of each joint's travel
_STEPS = 10
_APART = 2e-3  # rad or m within 10 steps of 2 ms: single precision and another order of contacts stay below


def sweep_beside_mujoco(model: Any, stepped: Callable[[np.ndarray, int], Stepped]) -> str:
    """Description of the engine's deviations from MuJoCo; empty where both move alike from every position of every joint.

    `stepped` returns the positions after a number of steps, started at rest from given positions.
    """
    for joint in range(model.njnt):
        if model.jnt_type[joint] not in (2, 3):  # slides and hinges
            continue
        for share in _SHARES:
            qpos = model.qpos0.copy()
            low, high = model.jnt_range[joint]
            qpos[model.jnt_qposadr[joint]] = low + share * (high - low)
            found, wanted = stepped(qpos, _STEPS), _in_mujoco(model, qpos)
            where = f"with {model.joint(joint).name} at {share:.0%}"
            if not np.isfinite(found).all():
                return f"it diverges {where}"
            apart = np.abs(found - wanted)
            if apart.max() > _APART:
                moved = _joint_of(model, int(apart.argmax()))
                return f"{where}, {moved} is {apart.max():.2g} from where MuJoCo has it after {_STEPS} steps"
    return ""


def _in_mujoco(model: Any, qpos: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_step(model, data, _STEPS)
    return np.array(data.qpos)


def _joint_of(model: Any, address: int) -> str:
    joint = int(np.searchsorted(model.jnt_qposadr, address, side="right")) - 1
    return str(model.joint(joint).name)
