"""Array shapes are checked while the tests run; production pays nothing for them."""

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


@pytest.fixture(scope="session")
def kitchen_bundle(tmp_path_factory: pytest.TempPathFactory) -> "tuple[Path, Certificate]":
    """A small kitchen as the exporter writes it, one of its objects made from the scan; the zip, and its folder beside it."""
    from r2c2r_core.export.stage import ExportConfig, write_bundle
    from tests.core.export.kitchen import CREATED, reconstruction

    path = tmp_path_factory.mktemp("kitchen") / "kitchen.zip"
    return path, write_bundle(reconstruction(), path, ExportConfig(keep_folder=True), created=CREATED)
