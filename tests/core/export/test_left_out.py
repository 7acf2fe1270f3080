"""Objects that fail while the bundle is written are left out, and the rest is certified."""

import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from r2c2r_core.errors import R2C2RError
from r2c2r_core.export import plan as planning
from r2c2r_core.export import stage, support
from r2c2r_core.export.stage import ExportConfig, write_bundle
from r2c2r_core.export.writers import table
from r2c2r_core.model.report import ALIKE, Certificate
from r2c2r_core.model.scene import ArticulatedScene
from tests.core.export.kitchen import CREATED, bottle, counter, reconstruction

QUICK = ExportConfig(pictures=False, gripper=False, texture_max_px=64)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skip the dynamics, as only the bundle's contents are checked here."""
    judged = Certificate(
        passed=True,
        likeness=ALIKE,
        findings=(),
        loaders=(),
        joints=(),
        rest_penetration_m=0.0,
        drift_m=0.0,
        realtime_factor=1.0,
    )
    monkeypatch.setattr(stage, "certify", lambda folder, progress: judged)
    monkeypatch.setattr(stage, "preview_png", lambda *_: b"")


def names(path: Path) -> set[str]:
    with zipfile.ZipFile(path) as archive:
        return set(archive.namelist())


@pytest.mark.parametrize("step", ["plan", "meshes"])
def test_an_object_that_fails_to_export_is_omitted_and_reported(
    step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, name = (planning, "_bodies_of") if step == "plan" else (stage, "write_body")
    real = getattr(module, name)

    def fails(item: Any, *further: Any) -> Any:
        result = real(item, *further)
        if "bottle_1" in (getattr(item, "name", ""), getattr(item, "object_name", "")):
            raise cv2.error("(-215) empty")
        return result

    monkeypatch.setattr(module, name, fails)
    certificate = write_bundle(reconstruction(), tmp_path / "b.zip", QUICK, created=CREATED)
    assert set(certificate.left_out) == {"bottle_1"}
    assert certificate.left_out["bottle_1"].startswith("export: bottle_1: error: ")
    found = names(tmp_path / "b.zip")
    assert not [path for path in found if path.startswith("assets/bottle_1/")]
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        urdf = archive.read("scene.urdf").decode()
        assert "bottle_1" not in urdf
        assert "cabinet_1" in urdf
        assert "bottle_1" in archive.read("report.json").decode()


def test_an_object_whose_support_search_fails_is_exported_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bottle is 5 mm above the counter, onto which the search would lower it."""

    def fails(*_: Any) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(support, "_gap_below", fails)
    objects = (counter("counter_1"), bottle("bottle_1", bottom_z=0.87))
    scene = ArticulatedScene(name="t", objects=objects, layout_moves_m={}, warnings=())
    assert write_bundle(reconstruction(scene), tmp_path / "b.zip", QUICK, created=CREATED).left_out == {}
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        origin = ET.fromstring(archive.read("scene.urdf")).find("joint[@name='bottle_1_body_to_world']/origin")
    assert origin is not None
    assert [float(number) for number in origin.attrib["xyz"].split()] == pytest.approx([0.2, -0.1, 0.87], abs=1e-6)


@pytest.mark.parametrize(("step", "file"), [("scan_fits", ""), ("preview_png", "preview.png"), ("review_html", "review.html")])
def test_failing_evidence_is_omitted_and_the_scene_is_exported(
    step: str, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise cv2.error("(-215) empty")

    monkeypatch.setattr(stage, step, fails)
    write_bundle(reconstruction(), tmp_path / "b.zip", QUICK, created=CREATED)
    found = names(tmp_path / "b.zip")
    assert "scene.urdf" in found
    assert file not in found


@pytest.mark.parametrize("name", ["mjcf", "usd", "glb"])
def test_a_failing_format_is_omitted_and_the_others_are_exported(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(plan: Any, path: Path) -> None:
        path.write_text("half")
        raise np.linalg.LinAlgError("SVD did not converge")

    lost = next(entry for entry in table.FORMATS if entry.name == name)
    changed = tuple(replace(entry, write=fails) if entry is lost else entry for entry in table.FORMATS)
    monkeypatch.setattr(table, "FORMATS", changed)
    write_bundle(reconstruction(), tmp_path / "b.zip", QUICK, created=CREATED)
    assert {entry.file for entry in table.FORMATS} - names(tmp_path / "b.zip") == {lost.file}


def test_a_full_disk_raises_instead_of_omitting_a_format(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(plan: Any, path: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(table, "FORMATS", tuple(replace(entry, write=fails) for entry in table.FORMATS))
    with pytest.raises((OSError, R2C2RError)):
        write_bundle(reconstruction(), tmp_path / "b.zip", QUICK, created=CREATED)
