"""The valid kitchen as a bundle's folder, without the slow parts (preview, reports)."""

import importlib
import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

import r2c2r_core.export.probes as probes
from r2c2r_core.export.handles import with_handles
from r2c2r_core.export.manifest import manifest_of
from r2c2r_core.export.plan import Plan, plan_bundle
from r2c2r_core.export.stage import write_scene
from r2c2r_core.export.support import supported
from r2c2r_core.export.writers.meshes import write_body
from r2c2r_core.export.writers.table import formats, write_formats
from r2c2r_core.model.scene import ArticulatedScene
from tests.core.export.kitchen import kitchen, reconstruction


@pytest.fixture(scope="session")
def written_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundle's folder, written once; tests copy it."""
    return write_folder(kitchen(), tmp_path_factory.mktemp("bundle") / "good")


@pytest.fixture
def good_folder(written_folder: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(written_folder, tmp_path / "good"))


def write_folder(scene: ArticulatedScene, folder: Path) -> Path:
    folder.mkdir(parents=True)
    plan = with_handles(supported(plan_bundle(scene)))
    write_meshes(plan, folder)
    plan = write_scene(plan, folder)
    write_formats(plan, folder, [entry for entry in formats() if entry.file != "scene.xml"])
    (folder / "manifest.json").write_text(json.dumps(manifest_of(reconstruction(scene), plan, None)))
    (folder / "README.txt").write_text("read me")
    (folder / "preview.png").write_bytes(b"not looked at")
    return folder


def write_meshes(plan: Plan, folder: Path, texture_max_px: int = 2048) -> None:
    for body in plan.bodies:
        write_body(body, folder, texture_max_px)


def probe(name: str) -> Any:
    """A probe, imported as the program that it is: with its folder on the path, where it finds its neighbours."""
    folder = str(Path(probes.__file__).parent)
    sys.path.insert(0, folder)
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(folder)
