"""Put one object into a PyBullet scene of your own and open it: python examples/asset_in_pybullet.py FOLDER OBJECT

FOLDER is an unpacked bundle.
"""

import importlib.util
import sys
from pathlib import Path


def main(folder: str, name: str) -> None:
    asset = Path(folder).resolve() / "assets" / name / f"{name}.urdf"
    if not asset.is_file():
        sys.exit(f"{asset}: there is no such object")
    if importlib.util.find_spec("pybullet") is None:
        print("not run: PyBullet is not installed here (pip install pybullet)")
        return
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81)
    turned = pybullet.getQuaternionFromEuler([0, 0, 1.57])
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE
    unit = pybullet.loadURDF(str(asset), [1, 2, 0], turned, flags=flags)
    joints = [pybullet.getJointInfo(unit, number) for number in range(pybullet.getNumJoints(unit))]
    moving = [joint for joint in joints if joint[2] in (pybullet.JOINT_REVOLUTE, pybullet.JOINT_PRISMATIC)]
    for joint in moving:
        target = {"targetVelocity": 1.0, "force": 30.0 if joint[2] == pybullet.JOINT_PRISMATIC else 10.0}  # N, N m
        pybullet.setJointMotorControl2(unit, joint[0], pybullet.VELOCITY_CONTROL, **target)
    for _ in range(3 * 240):  # its step is 1/240 s
        pybullet.stepSimulation()
    for joint in moving:
        print(f"{joint[1].decode()}: {pybullet.getJointState(unit, joint[0])[0]:.2f} of {joint[9]:.2f}")
    pybullet.disconnect()


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
