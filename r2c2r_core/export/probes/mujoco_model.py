"""Compile a URDF or an MJCF in MuJoCo and read back its values. MuJoCo has no maximum joint velocity."""

from pathlib import Path
from typing import Any

import numpy as np


def read_back(scene: Path) -> dict[str, Any]:
    """Joints and bodies as stored by MuJoCo; raises MuJoCo's own errors on a rejected scene."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return held_by(model, data)


def held_by(model: Any, data: Any) -> dict[str, Any]:
    """Joints and bodies of a model, with kinematics already computed in `data`."""
    import mujoco

    moving = [j for j in range(model.njnt) if model.jnt_type[j] in _KINDS]
    return {
        "version": f"MuJoCo {mujoco.__version__}",
        "joints": {model.joint(j).name: _joint(model, data, j) for j in moving},
        "bodies": {model.body(b).name: _body(model, data, b) for b in range(1, model.nbody)},
    }


_KINDS = {2: "prismatic", 3: "revolute"}


def _joint(model: Any, data: Any, joint: int) -> dict[str, Any]:
    lower, upper = map(float, model.jnt_range[joint]) if model.jnt_limited[joint] else (-np.inf, np.inf)
    dof = int(model.jnt_dofadr[joint])
    return {
        "type": _KINDS[int(model.jnt_type[joint])],
        "axis_world": data.xaxis[joint],
        "origin_world": data.xanchor[joint],
        "lower": lower,
        "upper": upper,
        "damping": float(model.dof_damping[dof]),
        "friction": float(model.dof_frictionloss[dof]),
        "effort": float(model.jnt_actfrcrange[joint, 1]) if model.jnt_actfrclimited[joint] else np.inf,
    }


def _body(model: Any, data: Any, body: int) -> dict[str, Any]:
    principal = data.ximat[body].reshape(3, 3)
    own = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body]
    return {
        "mass_kg": float(model.body_mass[body]),
        "com_world": data.xipos[body],
        "inertia_world": principal @ np.diag(model.body_inertia[body]) @ principal.T,
        "rotation_world": data.xmat[body].reshape(3, 3),
        "origin_world": data.xpos[body],
        "colliders": sum(bool(model.geom_contype[g] or model.geom_conaffinity[g]) for g in own),
    }
