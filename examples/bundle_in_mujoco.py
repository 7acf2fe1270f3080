"""Open every joint of a bundle in MuJoCo: python examples/bundle_in_mujoco.py FOLDER (an unpacked bundle)"""

import sys
from pathlib import Path

import mujoco


def main(folder: str) -> None:
    model = mujoco.MjModel.from_xml_path(str(Path(folder) / "scene.xml"))
    data = mujoco.MjData(model)
    hinge, slide = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
    for joint in (j for j in range(model.njnt) if model.jnt_type[j] in (hinge, slide)):
        mujoco.mj_resetData(model, data)
        upper = model.jnt_range[joint, 1]
        force = 30.0 if model.jnt_type[joint] == slide else 10.0  # N for slides, N m for hinges
        for _ in range(round(3.0 / model.opt.timestep)):
            data.qfrc_applied[model.jnt_dofadr[joint]] = force
            mujoco.mj_step(model, data)
        print(f"{model.joint(joint).name}: {data.qpos[model.jnt_qposadr[joint]]:.2f} of {upper:.2f}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
