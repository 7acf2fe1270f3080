"""Load a URDF in PyBullet, release every joint along its travel, write out its values: `bullet.py scene.urdf answer.json`."""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from releasing import STEP_S, STEPS, release_everywhere  # type: ignore[import-not-found]  # the file beside this one


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
    problem = _swept(pybullet, body, joints)
    pybullet.disconnect(client)
    return {"version": f"PyBullet {version('pybullet')}", "joints": joints, "bodies": bodies, "problem": problem}


def _swept(pybullet: Any, body: int, joints: dict[str, Any]) -> str:
    """Description of the first joint that fails the release sweep, without the default motors; empty where none does."""
    number = {pybullet.getJointInfo(body, k)[1].decode(): k for k in range(pybullet.getNumJoints(body))}
    pybullet.setTimeStep(STEP_S)
    pybullet.setGravity(0, 0, -9.81)
    for name in joints:
        pybullet.setJointMotorControl2(body, number[name], pybullet.VELOCITY_CONTROL, force=0)

    def released(name: str, position: float) -> float:
        for other in joints:
            pybullet.resetJointState(body, number[other], position if other == name else 0.0)
        for _ in range(STEPS):
            pybullet.stepSimulation()
        return float(pybullet.getJointState(body, number[name])[0])

    return str(release_everywhere({name: (joint["lower"], joint["upper"]) for name, joint in joints.items()}, released))


def _rotation(pybullet: Any, quat_xyzw: tuple[float, ...]) -> np.ndarray:
    return np.array(pybullet.getMatrixFromQuaternion(quat_xyzw)).reshape(3, 3)


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(sys.argv[1])))
