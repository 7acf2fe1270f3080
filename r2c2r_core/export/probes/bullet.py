"""Load a URDF in PyBullet and write what it holds: `python bullet.py scene.urdf answer.json`."""

import json
import sys
from importlib.metadata import version
from pathlib import Path


def read_back(urdf: str) -> dict[str, object]:
    """Joints, masses and colliders as PyBullet holds them; the world link must hold the scene without a flag."""
    import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    body = pybullet.loadURDF(urdf, flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
    kinds = {pybullet.JOINT_REVOLUTE: "revolute", pybullet.JOINT_PRISMATIC: "prismatic"}
    joints, masses, colliders = {}, {}, {}
    for index in range(pybullet.getNumJoints(body)):
        info = pybullet.getJointInfo(body, index)
        link = info[12].decode()
        masses[link] = pybullet.getDynamicsInfo(body, index)[0]
        shapes = pybullet.getCollisionShapeData(body, index)
        if shapes:
            colliders[link] = len(shapes)
        if info[2] in kinds:
            joints[info[1].decode()] = (kinds[info[2]], info[8], info[9])
    pybullet.disconnect(client)
    return {"version": f"PyBullet {version('pybullet')}", "joints": joints, "masses": masses, "colliders": colliders}


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(sys.argv[1])))
