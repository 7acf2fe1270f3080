import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from r2c2r_core.export import loaders
from r2c2r_core.export.loaders import APART, EVERY_LOADER, try_loaders
from r2c2r_core.export.reading import read_urdf
from r2c2r_core.model.report import LoaderResult


def verdicts(folder: Path, sapien_python: str | None = None) -> dict[str, LoaderResult]:
    results = try_loaders(folder, read_urdf(folder / "scene.urdf"), sapien_python)
    assert tuple(r.loader for r in results) == EVERY_LOADER
    return {r.loader: r for r in results}


GIVEN = {name: os.environ.get(own.variable, "") for name, own in APART.items()}


def own_environment(name: str) -> pytest.MarkDecorator:
    given = Path(GIVEN[name]).is_file()
    return pytest.mark.skipif(not given, reason=f"no Python environment of {name}: set {APART[name].variable} to its python")


@own_environment("Drake")
def test_drake_accepts_the_good_bundle_and_detects_an_edited_limit(good_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(APART["Drake"].variable, GIVEN["Drake"])
    found = verdicts(good_folder)["Drake"]
    assert found.state == "passed", found
    assert found.detail.endswith("it does not keep joint friction or effort")
    scene = good_folder / "scene.sdf"
    scene.write_text(scene.read_text().replace("<upper>0.42</upper>", "<upper>0.9</upper>"))
    assert "drawer_1_slide has limits 0 .. 0.9, not 0 .. 0.42" in verdicts(good_folder)["Drake"].detail


@pytest.mark.parametrize("name", [pytest.param(name, marks=own_environment(name)) for name in ("MJX", "MuJoCo Warp")])
def test_mjcf_based_engines_move_the_good_bundle_like_mujoco(
    good_folder: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setenv(APART[name].variable, GIVEN[name])
    found = verdicts(good_folder)[name]
    assert found.state == "passed", found
    assert "4 joints, 9 links" in found.detail
    assert [worlds for worlds, _ in found.steps_per_s] == ([1, 256] if name == "MuJoCo Warp" else [])


@own_environment("Newton")
def test_newton_keeps_all_values_except_velocity_and_fixed_bodies(good_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(APART["Newton"].variable, GIVEN["Newton"])
    found = verdicts(good_folder)["Newton"]
    assert found.state == "passed", found
    assert "4 joints, 8 links" in found.detail
    assert found.detail.endswith("it does not keep joint velocity")


@own_environment("Genesis")
def test_genesis_accepts_the_good_bundle_and_detects_an_edited_limit(
    good_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(APART["Genesis"].variable, GIVEN["Genesis"])
    found = verdicts(good_folder)["Genesis"]
    assert found.state == "passed", found
    assert "4 joints, 9 links" in found.detail
    assert found.detail.endswith("it does not keep joint velocity")
    scene = good_folder / "scene.xml"
    scene.write_text(scene.read_text().replace('range="0 0.42"', 'range="0 0.9"'))
    assert "drawer_1_slide has limits 0 .. 0.9, not 0 .. 0.42" in verdicts(good_folder)["Genesis"].detail


@own_environment("NVIDIA asset validator")
def test_nvidias_validator_passes_the_good_bundle_and_fails_one_without_a_unit(
    good_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = "NVIDIA asset validator"
    monkeypatch.setenv(APART[name].variable, GIVEN[name])
    assert verdicts(good_folder)[name].state == "passed"
    scene = good_folder / "scene.usda"
    scene.write_text(scene.read_text().replace("metersPerUnit = 1", "").replace('upAxis = "Z"', ""))
    assert verdicts(good_folder)[name].state == "failed"


@pytest.fixture(autouse=True)
def no_environments(monkeypatch: pytest.MonkeyPatch) -> None:
    for own in APART.values():
        monkeypatch.delenv(own.variable, raising=False)


def test_the_good_bundle_loads_in_yourdfpy_mujoco_pybullet_and_usd(good_folder: Path) -> None:
    found = verdicts(good_folder)
    for name in ("yourdfpy", "MuJoCo (URDF)", "MuJoCo (MJCF)", "PyBullet", "USD"):
        assert found[name].state == "passed", found[name]
        assert "4 joints, 9 links" in found[name].detail
    assert found["MuJoCo (MJCF)"].detail.endswith("it does not keep joint velocity")


def test_usd_is_loaded_in_a_separate_process(good_folder: Path) -> None:
    """USD's libraries acquire the GIL while loading, which deadlocked with another thread that imported a library."""
    code = """
import sys
from pathlib import Path
from r2c2r_core.export.loaders import try_loaders
from r2c2r_core.export.reading import read_urdf
folder = Path(sys.argv[1])
found = {result.loader: result.state for result in try_loaders(folder, read_urdf(folder / "scene.urdf"))}
print(found["USD"], "pxr" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code, str(good_folder)], capture_output=True, text=True, check=True)
    assert done.stdout.split()[-2:] == ["passed", "False"]


def test_a_missing_loader_is_reported_as_not_tried(good_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib.util

    real = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *rest: None if name == "pybullet" else real(name, *rest))
    found = verdicts(good_folder)
    assert found["PyBullet"].state == "not tried"
    assert "pip install" in found["PyBullet"].detail
    for name, own in APART.items():
        assert found[name].state == "not tried"
        assert own.variable in found[name].detail


@pytest.mark.parametrize("python", ["/nowhere/python", "/bin/false"])
def test_an_invalid_sapien_python_is_reported_as_not_tried(good_folder: Path, python: str) -> None:
    result = verdicts(good_folder, python)["SAPIEN"]
    assert result.state == "not tried"
    assert python in result.detail


@pytest.mark.parametrize(
    ("code", "says"),
    [
        ("bytearray(1 << 30)", "failed (limited to 0.5 GB): MemoryError"),
        ("import os; os.kill(os.getpid(), 9)", "killed by SIGKILL (limited to 0.5 GB): no output"),
    ],
)
def test_a_loader_that_needs_too_much_memory_fails_alone(
    good_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, says: str
) -> None:
    monkeypatch.setattr(loaders, "free_memory", lambda share: 1 << 29)
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n[ $1 = -c ] || exec {sys.executable} -c '{code}'\n")
    python.chmod(0o755)
    result = verdicts(good_folder, str(python))["SAPIEN"]
    assert (result.state, result.detail) == ("failed", f"RuntimeError: {says}")


@own_environment("SAPIEN")
def test_the_good_bundle_loads_in_sapien(good_folder: Path) -> None:
    result = verdicts(good_folder, GIVEN["SAPIEN"])["SAPIEN"]
    assert result.state == "passed", result.detail


def test_a_missing_collider_mesh_fails_the_loaders(good_folder: Path) -> None:
    """PyBullet silently ignores a missing mesh; the comparison of collision shapes detects it."""
    (good_folder / "assets/bottle_1/meshes/bottle_1_body_col_0.obj").unlink()
    found = verdicts(good_folder)
    assert found["PyBullet"].state == "failed"
    assert found["MuJoCo (URDF)"].state == "failed"
    assert "\n" not in found["MuJoCo (URDF)"].detail


def test_an_mjcf_with_different_limits_fails(good_folder: Path) -> None:
    document = ET.parse(good_folder / "scene.xml")
    next(j for j in document.iter("joint") if j.get("name") == "drawer_1_slide").set("range", "0 0.9")
    document.write(good_folder / "scene.xml")
    found = verdicts(good_folder)
    assert found["MuJoCo (MJCF)"].state == "failed"
    assert "drawer_1_slide has limits 0 .. 0.9, not 0 .. 0.42" in found["MuJoCo (MJCF)"].detail
    assert found["MuJoCo (URDF)"].state == "passed"


USD_DEFECTS = (
    ("drawer_1", "physics:upperLimit = 0.42", "physics:upperLimit = 0.9", "drawer_1_slide has limits 0 .. 0.9, not 0 .. 0.42"),
    ("cabinet_1", "PhysicsRevoluteJoint", "PhysicsPrismaticJoint", "is prismatic, not revolute"),
    (None, 'upAxis = "Z"', 'upAxis = "Y"', "up axis"),
    ("drawer_1", "physics:localPos1 = (0, 0, 0)", "physics:localPos1 = (0, 0, 0.1)", "its frame differs by 0.1"),
    (
        "drawer_1",
        "rel physics:body1 = </drawer_1/drawer_1_drawer>",
        "rel physics:body1 = </drawer_1/nowhere>",
        "USD's validators",
    ),
)


@pytest.mark.parametrize(("asset", "old", "new", "says"), USD_DEFECTS, ids=[d[3] for d in USD_DEFECTS])
def test_a_usd_with_different_values_fails(good_folder: Path, asset: str | None, old: str, new: str, says: str) -> None:
    scene = good_folder / ("scene.usda" if asset is None else f"assets/{asset}/{asset}.usda")
    text = scene.read_text()
    assert old in text
    scene.write_text(text.replace(old, new))
    found = verdicts(good_folder)
    assert found["USD"].state == "failed"
    assert says in found["USD"].detail
    assert found["yourdfpy"].state == "passed"


def test_loaders_open_a_bundle_with_spaces_and_unicode_in_its_path(good_folder: Path, tmp_path: Path) -> None:
    moved = tmp_path / "Küche 1 – キッチン"
    good_folder.rename(moved)
    found = verdicts(moved, GIVEN["SAPIEN"] or None)
    assert {r.state for r in found.values()} <= {"passed", "not tried"}, found
    assert found["PyBullet"].state == found["USD"].state == found["MuJoCo (MJCF)"].state == "passed"
