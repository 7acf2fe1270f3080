"""Load a URDF in PyBullet and write out its values: `python bullet.py scene.urdf answer.json`."""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np


def read_back(urdf: str) -> dict[str, Any]:
    """Joints and bodies as stored by PyBullet; the world link must fix the scene without a flag."""
    import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    # without the flag PyBullet computes an inertia from the colliders
    body = pybullet.loadURDF(urdf, flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
    kinds = {pybullet.JOINT_REVOLUTE: "revolute", pybullet.JOINT_PRISMATIC: "prismatic"}
    joints, bodies = {}, {}
    for index in range(pybullet.getNumJoints(body)):
        info = pybullet.getJointInfo(body, index)
        state = pybullet.getLinkState(body, index, computeForwardKinematics=True)
        dynamics = pybullet.getDynamicsInfo(body, index)
        principal = _rotation(pybullet, state[1])  # world from principal axes, in which PyBullet gives axis and moments
        bodies[info[12].decode()] = {
            "mass_kg": dynamics[0],
            "com_world": state[0],
            "inertia_world": (principal @ np.diag(dynamics[2]) @ principal.T).tolist(),
            "rotation_world": _rotation(pybullet, state[5]).tolist(),
            "origin_world": state[4],
            "colliders": len(pybullet.getCollisionShapeData(body, index)),
        }
        if info[2] in kinds:
            joints[info[1].decode()] = {
                "type": kinds[info[2]],
                "axis_world": (principal @ np.array(info[13])).tolist(),
                "origin_world": state[4],
                "lower": info[8],
                "upper": info[9],
                "damping": info[6],
                "friction": info[7],
                "effort": info[10],
                "velocity": info[11],
            }
    pybullet.disconnect(client)
    return {"version": f"PyBullet {version('pybullet')}", "joints": joints, "bodies": bodies}


def _rotation(pybullet: Any, quat_xyzw: tuple[float, ...]) -> np.ndarray:
    return np.array(pybullet.getMatrixFromQuaternion(quat_xyzw)).reshape(3, 3)


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(sys.argv[1])))
