"""Load scene.xml in MuJoCo Warp, on the CPU, and write out its values: `python warp_probe.py scene.xml answer.json`.

Runs in a separate environment, so it imports nothing from r2c2r but its neighbouring scripts. Values are read back from
Warp's arrays. Every joint is swept in parallel with MuJoCo, and the step rate is measured for one world and for 256.
"""

import json
import sys
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco_model import held_by  # type: ignore[import-not-found]  # the file beside this one
from sweeping import HELD, sweep_beside_mujoco  # type: ignore[import-not-found]

_WORLDS = (1, 256)
_COUNTED_STEPS = 10
_ROOM = {
    "njmax": 1024,
    "nconmax": 512,
}  # constraints, contacts per world: else sized by the first state, and any excess is dropped


def read_back(scene: Path) -> dict[str, Any]:
    """Joints and bodies as stored by MuJoCo Warp, joints closed; `problem` where its motion differs from MuJoCo's."""
    import mujoco_warp  # type: ignore[import-not-found]  # lives in an environment of its own
    import warp  # type: ignore[import-not-found]

    model = mujoco.MjModel.from_xml_path(str(scene))
    rest = mujoco.MjData(model)
    mujoco.mj_forward(model, rest)
    with warp.ScopedDevice("cpu"):
        on_device = mujoco_warp.put_model(model)

        def stepped(qpos: np.ndarray, steps: int) -> np.ndarray:
            data = mujoco.MjData(model)
            data.qpos[:] = qpos
            mujoco.mj_forward(model, data)
            state = mujoco_warp.put_data(model, data, **_ROOM)
            for _ in range(steps):
                mujoco_warp.step(on_device, state)
            return np.array(state.qpos.numpy()[0])

        def steps_per_s(worlds: int) -> float:
            state = mujoco_warp.put_data(model, rest, nworld=worlds, **_ROOM)
            mujoco_warp.step(on_device, state)
            began = time.perf_counter()
            for _ in range(_COUNTED_STEPS):
                mujoco_warp.step(on_device, state)
            return worlds * _COUNTED_STEPS / (time.perf_counter() - began)

        problem = sweep_beside_mujoco(model, stepped)
        speeds = {str(worlds): steps_per_s(worlds) for worlds in _WORLDS}
        own = mujoco.MjModel.from_xml_path(str(scene))
        for name in HELD:
            held = getattr(on_device, name).numpy()
            target = getattr(own, name)
            target[:] = held[0] if held.ndim > target.ndim else held  # of one world, where worlds may differ
        state = mujoco_warp.put_data(model, rest, **_ROOM)
        mujoco_warp.kinematics(on_device, state)
        mujoco_warp.com_pos(on_device, state)
        mujoco_warp.get_data_into(rest, model, state)
    said = {"version": f"MuJoCo Warp {version('mujoco-warp')}", "problem": problem, "steps_per_s": speeds}
    return held_by(own, rest) | said


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(Path(sys.argv[1])), default=np.ndarray.tolist))
