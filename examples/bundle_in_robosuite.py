"""Open a bundle beside a robosuite robot: python examples/bundle_in_robosuite.py FOLDER (an unpacked bundle)

Needs `pip install robosuite`. Its models are MJCF, like the bundle's scene, so one is merged into the other.
"""

import importlib.util
import json
import sys
from pathlib import Path


def main(folder: str) -> None:
    scene = Path(folder).resolve() / "scene.xml"
    if not scene.is_file():
        sys.exit(f"{scene}: no bundle's folder")
    if importlib.util.find_spec("robosuite") is None:
        print("not run: robosuite is not installed here (pip install robosuite)")
        return
    import mujoco
    from robosuite.models import MujocoWorldBase
    from robosuite.models.base import MujocoXML
    from robosuite.models.grippers import gripper_factory
    from robosuite.models.robots import Panda

    robot = Panda()
    robot.add_gripper(gripper_factory("PandaGripper"))
    robot.set_base_xpos([0.0, -1.0, 0.4])
    world = MujocoWorldBase()
    world.merge(robot)
    world.merge(MujocoXML(str(scene)))
    model = world.get_model(mode="mujoco")
    data = mujoco.MjData(model)
    for name, position in json.loads((scene.parent / "manifest.json").read_text())["states"]["open"].items():
        data.joint(name).qpos[0] = position
    for _ in range(100):
        mujoco.mj_step(model, data)
    for joint in range(model.njnt):
        if model.jnt_limited[joint]:
            print(f"{model.joint(joint).name}: {data.qpos[model.jnt_qposadr[joint]]:.2f}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
