"""Shared fixtures, and runtime checks of array shapes that are active only in tests."""

import gc
import importlib.machinery
import importlib.util
import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from r2c2r_core.model.report import Certificate

os.environ.setdefault("OMP_NUM_THREADS", "1")  # the suite runs two processes on two cores

from jaxtyping import install_import_hook

import tests.typechecker  # noqa: F401  # the hook looks it up as an attribute of `tests`

if os.environ.get("R2C2R_SHAPES", "1") == "1":
    install_import_hook(["r2c2r_core.geometry"], "tests.typechecker.checked")


def pytest_collection_finish() -> None:
    """Collect garbage less often, as the served app does: a sixth of the time of the app's tests."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000)


@pytest.fixture
def torch_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The packages of learned models look installed, as long as nothing imports them."""
    find = importlib.util.find_spec
    found = {name: importlib.machinery.ModuleSpec(name, None) for name in ("torch", "transformers")}
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *more: found.get(name) or find(name, *more))


@pytest.fixture(scope="session")
def kitchen_bundle(tmp_path_factory: pytest.TempPathFactory) -> "tuple[Path, Certificate]":
    """Bundle of a small kitchen as exported, with one object made from the scan: the zip, its folder next to it."""
    from r2c2r_core.export.stage import ExportConfig, write_bundle
    from tests.core.export.kitchen import CREATED, reconstruction

    path = tmp_path_factory.mktemp("kitchen") / "kitchen.zip"
    return path, write_bundle(reconstruction(), path, ExportConfig(keep_folder=True), created=CREATED)
