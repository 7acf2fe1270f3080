"""Load scene.xml in MJX and write out its values: `python mjx_probe.py scene.xml answer.json`.

Runs in MJX's own environment, so it imports nothing from r2c2r but its neighbouring scripts. Values are read back from the
arrays on MJX's device. Every joint is swept; from each position MJX and MuJoCo step in parallel.
"""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco_model import held_by  # type: ignore[import-not-found]  # the file beside this one
from sweeping import HELD, Stepped, sweep_beside_mujoco  # type: ignore[import-not-found]


def read_back(scene: Path) -> dict[str, Any]:
    """Joints and bodies as stored by MJX, joints closed; `problem` where its motion differs from MuJoCo's."""
    import jax  # type: ignore[import-not-found]  # lives in an environment of its own
    from mujoco import mjx

    model = mujoco.MjModel.from_xml_path(str(scene))
    on_device = mjx.put_model(model)
    own = mujoco.MjModel.from_xml_path(str(scene))
    for name in HELD:
        getattr(own, name)[:] = np.asarray(getattr(on_device, name))
    start = mjx.put_data(model, mujoco.MjData(model))
    step = jax.jit(mjx.step)

    def stepped(qpos: np.ndarray, steps: int) -> Stepped:
        state = start.replace(qpos=jax.numpy.asarray(qpos))
        for _ in range(steps):
            state = step(on_device, state)
        return np.asarray(state.qpos)

    closed = mjx.get_data(model, jax.jit(mjx.kinematics)(on_device, start))
    problem = sweep_beside_mujoco(model, stepped)
    return held_by(own, closed) | {"version": f"MJX {version('mujoco-mjx')}", "problem": problem}


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(Path(sys.argv[1])), default=np.ndarray.tolist))
