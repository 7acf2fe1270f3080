"""Joint sweeps compared with MuJoCo's, with MuJoCo's own steps in place of another engine's."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from tests.core.export.conftest import probe


@pytest.fixture(scope="module")
def sweeping() -> Any:
    return probe("sweeping")


def stepped_in(model: Any) -> Any:
    def stepped(qpos: np.ndarray, steps: int) -> np.ndarray:
        data = mujoco.MjData(model)
        data.qpos[:] = qpos
        mujoco.mj_step(model, data, steps)
        return np.array(data.qpos)

    return stepped


def test_an_engine_that_matches_mujoco_has_no_problem(good_folder: Path, sweeping: Any) -> None:
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    assert sweeping.sweep_beside_mujoco(model, stepped_in(model)) == ""


def test_an_engine_that_deviates_from_mujoco_is_reported(good_folder: Path, sweeping: Any) -> None:
    """Lost contact exclusions push a door out of its frame; a large gravity simulates this."""
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    other = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    other.dof_damping[:] = 0
    other.dof_frictionloss[:] = 0
    other.opt.gravity[:] = (0, 40, 0)  # gravity that opens every unconstrained joint
    assert "from where MuJoCo has it after 10 steps" in sweeping.sweep_beside_mujoco(model, stepped_in(other))


def test_an_engine_that_diverges_is_reported_with_the_joint(good_folder: Path, sweeping: Any) -> None:
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    problem = sweeping.sweep_beside_mujoco(model, lambda qpos, steps: np.full_like(qpos, np.nan))
    assert problem == "it diverges with cabinet_1_hinge at 0%"
