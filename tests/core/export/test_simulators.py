"""Code snippets that load a bundle into simulators: the files exist, and the snippets run where the simulator is installed."""

import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from r2c2r_core.export.assets import world_from_asset
from r2c2r_core.export.loaders import APART, EVERY_LOADER
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.simulators import Recipe, recipes
from r2c2r_core.export.writers.text import quat_wxyz_of
from tests.core.export.conftest import probe, write_folder
from tests.core.export.kitchen import kitchen
from tests.waiting import PATIENCE_S

RECIPES = {recipe.simulator: recipe for recipe in recipes("hand made", "cabinet_1")}
HERE = {"MuJoCo": "mujoco", "PyBullet": "pybullet"}
ELSEWHERE = {"MJX": "MJX", "MuJoCo Warp": "MuJoCo Warp", "Newton": "Newton", "Drake": "Drake", "Genesis": "Genesis"}
WITHOUT_A_DEVICE = {"SAPIEN, ManiSkill"}
NOT_FROM_PYPI = {"Isaac Sim", "Isaac Lab", "ROS 2", "Gazebo"}  # only files are checked: they need a GPU or a system
READERS = {"yourdfpy", "MuJoCo (URDF)", "USD"}  # loaders of the certificate that are not separate simulators


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(kitchen(), tmp_path_factory.mktemp("simulators") / "kitchen")


def test_every_certified_engine_has_a_recipe_and_all_recipes_are_listed() -> None:
    assert set(EVERY_LOADER) - READERS == {recipe.loader for recipe in RECIPES.values()} - {None}
    assert set(RECIPES) == {*HERE, *ELSEWHERE, *WITHOUT_A_DEVICE, *NOT_FROM_PYPI}


@pytest.mark.parametrize("recipe", RECIPES.values(), ids=RECIPES)
def test_files_referenced_by_a_recipe_exist_in_the_bundle(recipe: Recipe, folder: Path) -> None:
    named = re.findall(r"\b(?:scene\.(?:xml|urdf|usda|sdf|srdf)|assets/[\w/.]+\w)", f"{recipe.code} {recipe.note}")
    assert named or "PACKAGE" not in recipe.code
    assert [name for name in named if not (folder / name).is_file()] == []
    assert recipe.loader is None or recipe.loader in EVERY_LOADER


@pytest.mark.parametrize("recipe", [r for r in RECIPES.values() if r.language == "python"], ids=lambda r: r.simulator)
def test_recipe_code_compiles(recipe: Recipe) -> None:
    compile(recipe.code, recipe.simulator, "exec")


@pytest.mark.parametrize("simulator", HERE)
def test_recipe_code_runs(simulator: str, folder: Path) -> None:
    pytest.importorskip(HERE[simulator], reason=f"{RECIPES[simulator].install}")
    ran = subprocess.run(
        [sys.executable, "-c", RECIPES[simulator].code],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S * 4,
    )
    assert ran.returncode == 0, ran.stderr


def test_the_isaac_lab_recipe_configures_every_articulation_where_it_stands(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("isaaclab", "isaaclab.sim", "isaaclab.actuators", "isaaclab.assets"):
        monkeypatch.setitem(sys.modules, name, MagicMock(ArticulationCfg=Configured))
    monkeypatch.chdir(folder)
    said: dict[str, Any] = {}
    exec(RECIPES["Isaac Lab"].code, said)
    plan = plan_bundle(kitchen())
    assert set(said["units"]) == {"cabinet_1", "drawer_1", "double_1"}
    for name, unit in said["units"].items():
        pose = world_from_asset(plan, name)
        assert unit.prim_path == "{ENV_REGEX_NS}/Kitchen/" + name
        np.testing.assert_allclose(unit.init_state.pos, pose.translation, atol=1e-9)
        np.testing.assert_allclose(unit.init_state.rot, quat_wxyz_of(pose.rotation), atol=1e-9)


class Configured(SimpleNamespace):
    """Stand-in for Isaac Lab's ArticulationCfg: keeps what it is given."""

    InitialStateCfg = SimpleNamespace


@pytest.mark.parametrize("simulator", ELSEWHERE)
def test_recipe_code_runs_in_its_own_environment(simulator: str, folder: Path) -> None:
    python = os.environ.get(APART[ELSEWHERE[simulator]].variable)
    if not python:
        pytest.skip(f"{APART[ELSEWHERE[simulator]].variable} names no environment")
    code = RECIPES[simulator].code
    ran = subprocess.run([python, "-c", code], cwd=folder, capture_output=True, text=True, check=False, timeout=PATIENCE_S * 10)
    assert ran.returncode == 0, ran.stderr


def test_the_sapien_recipe_runs_without_a_gpu_as_its_note_describes(folder: Path, tmp_path: Path) -> None:
    python = os.environ.get(APART["SAPIEN"].variable)
    if not python:
        pytest.skip(f"{APART['SAPIEN'].variable} names no environment")
    recipe = RECIPES["SAPIEN, ManiSkill"]
    without = re.search(r"sapien\.Scene\([^)]*\)\]\)", recipe.note)
    assert without is not None
    code = recipe.code.replace("sapien.Scene()", without[0]).replace(
        "scene.urdf", str(probe("sapien_probe").without_visuals(folder / "scene.urdf", tmp_path))
    )
    ran = subprocess.run([python, "-c", code], cwd=folder, capture_output=True, text=True, check=False, timeout=PATIENCE_S * 4)
    assert ran.returncode == 0, ran.stderr


def test_the_ros_recipe_uses_the_package_name(folder: Path) -> None:
    assert "<name>hand_made</name>" in (folder / "package.xml").read_text()
    assert "ros2 launch hand_made view.launch.py" in RECIPES["ROS 2"].code
