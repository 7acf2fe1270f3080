"""Damaged or changed bundles are detected by the checksums in their manifest."""

import json
import os
import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from r2c2r_core.export import stage
from r2c2r_core.export.archive import write_zip
from r2c2r_core.export.preview import preview_png
from r2c2r_core.export.seal import check_seal
from r2c2r_core.export.stage import ExportConfig, check_bundle, write_bundle
from r2c2r_core.model.report import Certificate
from tests.core.export.kitchen import CREATED, kitchen, reconstruction

TEXTURE = "assets/cabinet_1/meshes/cabinet_1_door_vis.png"


@pytest.fixture
def folder(kitchen_bundle: tuple[Path, Certificate], tmp_path: Path) -> Path:
    return Path(shutil.copytree(kitchen_bundle[0].with_suffix(""), tmp_path / "bundle"))


def found(folder: Path) -> set[tuple[str, str, str]]:
    return {(one.severity, one.rule, one.where) for one in check_seal(folder)}


def test_an_unmodified_bundle_passes_the_checksum_check(folder: Path) -> None:
    assert check_seal(folder) == ()
    listed = json.loads((folder / "manifest.json").read_text())["files"]
    assert listed.keys() == {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()} - {"manifest.json"}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda f: (f / "scene.glb").write_bytes(os.urandom(5000)), ("error", "file-changed", "scene.glb")),
        (lambda f: shutil.copyfile(f / "preview.png", f / TEXTURE), ("error", "file-changed", TEXTURE)),
        (lambda f: (f / "report.html").unlink(), ("error", "file-lost", "report.html")),
        (lambda f: (f / "more.txt").write_text("more"), ("warning", "file-unlisted", "more.txt")),
    ],
    ids=["noise", "another texture", "a file gone", "a file more"],
)
def test_changed_files_are_reported(folder: Path, change: Callable[[Path], object], told: tuple[str, str, str]) -> None:
    change(folder)
    assert found(folder) == {told}
    assert all("\n" not in one.message for one in check_seal(folder))


def test_a_bundle_with_a_replaced_scene_glb_fails_the_check(folder: Path, tmp_path: Path) -> None:
    (folder / "scene.glb").write_bytes(b"noise")
    write_zip(folder, tmp_path / "noise.zip")
    certificate = check_bundle(tmp_path / "noise.zip")
    assert not certificate.passed
    assert ("file-changed", "scene.glb") in {(one.rule, one.where) for one in certificate.findings}


@pytest.mark.parametrize("content", ["", "[]", '{"files": 5}', "{}"])
def test_a_manifest_without_checksums_yields_at_most_a_warning(folder: Path, content: str) -> None:
    (folder / "manifest.json").write_text(content)
    assert found(folder) <= {("warning", "file-unsealed", "manifest.json")}


def test_equal_inputs_give_identical_bytes_regardless_of_timing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = replace(kitchen(), objects=tuple(item for item in kitchen().objects if item.name in ("cabinet_1", "bottle_1")))
    assert len(one.objects) == 2
    monkeypatch.setattr(stage, "preview_png", lambda plan, seen_from: preview_png(plan, seen_from, 64))
    write_bundle(reconstruction(one), tmp_path / "first.zip", ExportConfig(), created=CREATED)
    spent = time.thread_time
    monkeypatch.setattr(time, "thread_time", lambda: 3 * spent())
    monkeypatch.setenv("TZ", "Asia/Kathmandu")
    os.utime(tmp_path / "first.zip", (0, 0))
    write_bundle(reconstruction(one), tmp_path / "again.zip", ExportConfig(), created=CREATED)
    assert (tmp_path / "again.zip").read_bytes() == (tmp_path / "first.zip").read_bytes()


@pytest.mark.slow
def test_exporting_a_kitchen_twice_gives_identical_bytes(
    kitchen_bundle: tuple[Path, Certificate], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spent = time.thread_time
    monkeypatch.setattr(time, "thread_time", lambda: 3 * spent())
    monkeypatch.setenv("TZ", "Asia/Kathmandu")
    os.utime(kitchen_bundle[0], (0, 0))
    write_bundle(reconstruction(), tmp_path / "again.zip", ExportConfig(), created=CREATED)
    assert (tmp_path / "again.zip").read_bytes() == kitchen_bundle[0].read_bytes()
    for name in ("manifest.json", "report.json", "report.html"):
        assert "seconds" not in (kitchen_bundle[0].with_suffix("") / name).read_text()
