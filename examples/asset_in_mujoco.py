"""Put one object into a MuJoCo scene of your own and open it: python examples/asset_in_mujoco.py FOLDER OBJECT

FOLDER is an unpacked bundle.
"""

import sys
import tempfile
from pathlib import Path

import mujoco

SCENE = """<mujoco>
  <asset><model name="asset" file="{file}"/></asset>
  <worldbody><frame pos="1 2 0" euler="0 0 90"><attach model="asset" prefix="own_"/></frame></worldbody>
</mujoco>"""


def main(folder: str, name: str) -> None:
    asset = Path(folder).resolve() / "assets" / name / f"{name}.xml"
    if not asset.is_file():
        sys.exit(f"{asset}: there is no such object")
    with tempfile.TemporaryDirectory() as elsewhere:
        scene = Path(elsewhere) / "scene.xml"
        scene.write_text(SCENE.format(file=asset))
        model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    joints = [model.joint(number) for number in range(model.njnt)]
    moving = [joint for joint in joints if joint.type[0] != mujoco.mjtJoint.mjJNT_FREE]
    for joint in moving:
        data.qfrc_applied[joint.dofadr] = 30.0 if joint.type[0] == mujoco.mjtJoint.mjJNT_SLIDE else 10.0  # N, N m
    for _ in range(round(3.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    for joint in moving:
        print(f"{joint.name}: {data.qpos[joint.qposadr[0]]:.2f} of {joint.range[1]:.2f}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
