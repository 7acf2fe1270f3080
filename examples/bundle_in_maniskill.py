"""Open the joints of a bundle in a ManiSkill scene: python examples/bundle_in_maniskill.py FOLDER (an unpacked bundle)

Needs `pip install mani_skill`, and a Vulkan device for rendering. SAPIEN's loader drops joint friction, so it is set here.
"""

import importlib.util
import json
import sys
import xml.etree.ElementTree as ET
from pathlib import Path


def main(folder: str) -> None:
    urdf = Path(folder) / "scene.urdf"
    if not urdf.is_file():
        sys.exit(f"{urdf}: no bundle's folder")
    if importlib.util.find_spec("mani_skill") is None:
        print("not run: ManiSkill is not installed here (pip install mani_skill)")
        return
    import gymnasium
    import numpy as np
    from mani_skill.envs.sapien_env import BaseEnv
    from mani_skill.utils.registration import register_env

    dynamics = {joint.get("name"): joint.find("dynamics") for joint in ET.parse(urdf).getroot().iter("joint")}

    @register_env("Kitchen-v0", max_episode_steps=100)
    class Kitchen(BaseEnv):
        SUPPORTED_ROBOTS = ("panda",)

        def __init__(self, *arguments, robot_uids="panda", **named):
            super().__init__(*arguments, robot_uids=robot_uids, **named)

        def _load_scene(self, options):
            loader = self.scene.create_urdf_loader()
            loader.fix_root_link, loader.name = True, "kitchen"
            self.kitchen = loader.load(str(urdf))
            for joint in self.kitchen.active_joints:
                said = dynamics[joint.name].attrib
                joint.set_friction(float(said["friction"]))
                joint.set_drive_properties(0.0, float(said["damping"]))

        def _initialize_episode(self, env_idx, options):
            self.kitchen.set_qpos(np.zeros(self.kitchen.max_dof))

        def evaluate(self):
            return {}

    env = gymnasium.make("Kitchen-v0", obs_mode="state", render_mode=None)
    env.reset(seed=0)
    kitchen = env.unwrapped.kitchen
    opened = json.loads((urdf.parent / "manifest.json").read_text())["states"]["open"]
    kitchen.set_qpos(np.array([[opened[joint.name] for joint in kitchen.active_joints]]))
    for _ in range(10):
        env.step(env.action_space.sample())
    for joint, position in zip(kitchen.active_joints, kitchen.qpos[0].tolist(), strict=True):
        print(f"{joint.name}: {position:.2f}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
