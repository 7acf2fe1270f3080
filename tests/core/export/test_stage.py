"""The whole export: one bundle written and certified, with everything that product.md requires."""

import errno
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.errors import Cancelled, EnvironmentProblem, ExportFailed
from r2c2r_core.export import stage
from r2c2r_core.export.certify import certificate_to_json
from r2c2r_core.export.preview import preview_png
from r2c2r_core.export.stage import ExportConfig, check_bundle, write_bundle
from r2c2r_core.model.reconstruction import Reconstruction
from r2c2r_core.model.report import Certificate
from r2c2r_core.model.scene import ArticulatedScene
from r2c2r_core.progress import Progress
from r2c2r_core.schema.manifest import Manifest
from tests.core.export.kitchen import CREATED, cabinet, drawer, kitchen, reconstruction


def one_drawer() -> Reconstruction:
    """A scene with one drawer, for tests that do not depend on the bundle's contents."""
    return reconstruction(replace(kitchen(), objects=(drawer("drawer_1"),)))


@pytest.fixture
def small_preview(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small preview picture, as rendering takes most of an export's time."""
    monkeypatch.setattr(stage, "preview_png", lambda plan, seen_from: preview_png(plan, seen_from, 64))


def test_the_good_kitchen_is_certified(kitchen_bundle: tuple[Path, Certificate]) -> None:
    certificate = kitchen_bundle[1]
    assert certificate.passed
    assert {f.rule for f in certificate.findings} == {"together"}  # a drawer collides with a door at 92 degrees
    states = {r.loader: r.state for r in certificate.loaders}
    assert {states[name] for name in ("yourdfpy", "MuJoCo (URDF)", "MuJoCo (MJCF)", "PyBullet")} == {"passed"}
    assert states["SAPIEN"] in ("not tried", "passed")


def test_the_bundle_contains_the_documented_files(kitchen_bundle: tuple[Path, Certificate]) -> None:
    with zipfile.ZipFile(kitchen_bundle[0]) as archive:
        names = set(archive.namelist())
    assert {
        "scene.urdf",
        "scene.xml",
        "scene.glb",
        "manifest.json",
        "report.json",
        "report.html",
        "preview.png",
        "README.txt",
        "assets/cabinet_1/meshes/cabinet_1_door_vis.obj",
        "assets/cabinet_1/meshes/cabinet_1_door_vis.mtl",
        "assets/cabinet_1/meshes/cabinet_1_door_vis.png",
        "assets/bottle_1/meshes/bottle_1_body_col_0.obj",
    } <= names
    folder = kitchen_bundle[0].with_suffix("")
    assert {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()} == names


def test_the_gripper_opens_the_good_kitchen_with_films_in_the_report(kitchen_bundle: tuple[Path, Certificate]) -> None:
    with zipfile.ZipFile(kitchen_bundle[0]) as archive:
        names, page = set(archive.namelist()), archive.read("report.html").decode()
        gripper = json.loads(archive.read("report.json"))["gripper"]
    assert gripper["joints_opened"] == gripper["joints"] == 4
    assert {grip["name"]: grip["why"] for grip in gripper["grips"] if grip["why"]} == {
        "bottle_1_body": "wider than 76 mm all round"
    }
    for grip in gripper["grips"][:4]:
        assert f"gripper/{grip['film']}.jpg" in names
        assert f'href="gripper/{grip["film"]}.jpg"' in page
    assert "opened and closed 4 of 4 joints" in page


def test_the_gripper_check_can_be_disabled(tmp_path: Path, small_preview: None) -> None:
    write_bundle(one_drawer(), tmp_path / "b.zip", ExportConfig(gripper=False))
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        assert json.loads(archive.read("report.json"))["gripper"] is None
        assert not [name for name in archive.namelist() if name.startswith("gripper/")]


def test_no_other_files_are_left_beside_the_bundle(kitchen_bundle: tuple[Path, Certificate]) -> None:
    assert {p.name for p in kitchen_bundle[0].parent.iterdir()} == {"kitchen.zip", "kitchen"}


def test_checking_the_zip_or_its_folder_reproduces_the_certificate(kitchen_bundle: tuple[Path, Certificate]) -> None:
    path, certificate = kitchen_bundle
    for bundle in (path, path.with_suffix("")):
        again = check_bundle(bundle)
        assert replace(again, realtime_factor=0.0) == replace(certificate, realtime_factor=0.0)


def test_the_manifest_follows_its_schema(kitchen_bundle: tuple[Path, Certificate]) -> None:
    document = json.loads((kitchen_bundle[0].with_suffix("") / "manifest.json").read_text())
    assert list(document) == [
        "schema",
        "tool_version",
        "created",
        "capture",
        "world_from_capture",
        "objects",
        "states",
        "contradictions",
        "stages",
        "files",
    ]
    assert Manifest.model_validate(document).files.keys() == document["files"].keys()
    assert document["created"] == CREATED
    assert document["capture"] == {"name": "hand made", "sha256": "0" * 64, "format": "record3d", "frames": 2}
    np.testing.assert_allclose(document["world_from_capture"], reconstruction().capture.world_from_capture.matrix, atol=1e-8)
    door = document["objects"][0]
    keys = "name category dimensions_m world_from_object joint dimension_source mask candidates chosen placement warp meshes"
    assert set(keys.split()) | {"mass_kg", "warnings"} <= set(door)
    joint_keys = "name type axis origin lower upper uncut source confidence motion randomize handles blocked_by"
    assert set(door["joint"]) == set(joint_keys.split())
    assert door["joint"]["blocked_by"] == []
    assert [b["name"] for b in document["objects"][1]["joint"]["blocked_by"]] == ["double_1_left_hinge"]
    assert door["joint"]["source"] == {"axis": "inferred", "origin": "inferred", "lower": None, "limits": "default"}
    np.testing.assert_allclose(door["joint"]["axis"], [0, 0, -1], atol=1e-9)
    np.testing.assert_allclose(door["joint"]["origin"], [-0.6 - 0.597 / 2, -0.28, 0.1 + 0.36], atol=1e-9)
    assert door["mask"] == {"frames": 2, "mean_area_px": 2400.0, "prompts": [{"frame": 0, "x": 160.5, "y": 120.5, "label": 1}]}
    assert door["chosen"] == {"candidate": "c0", "by": "consensus", "at": None}
    assert document["objects"][3]["joint"] is None
    assert len(document["objects"][2]["joints"]) == 2
    assert document["contradictions"] == []
    assert document["stages"] == [{"name": "segment", "backend": "geometric", "config": {"voxel_m": 0.01}}]


def test_a_kitchen_that_fails_certification_is_still_written(tmp_path: Path, small_preview: None) -> None:
    scene = ArticulatedScene(name="t", objects=(cabinet("a"), cabinet("b", x=0.58)), layout_moves_m={}, warnings=())
    certificate = write_bundle(reconstruction(scene), tmp_path / "b.zip", ExportConfig(gripper=False))
    assert not certificate.passed
    assert not check_bundle(tmp_path / "b.zip").passed
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        assert json.loads(archive.read("report.json"))["certificate"]["passed"] is False
        assert b"failed" in archive.read("report.html")


@pytest.mark.parametrize("victim", ["write_body", "preview_png", "certify", "write_zip"])
def test_a_full_disk_keeps_the_old_bundle_and_leaves_no_partial_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_preview: None, victim: str
) -> None:
    destination = tmp_path / "b.zip"
    destination.write_bytes(b"the old bundle")

    def full(*args: object, **kwargs: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(stage, victim, full)
    with pytest.raises(EnvironmentProblem, match="disk is full") as caught:
        write_bundle(one_drawer(), destination, ExportConfig())
    assert "\n" not in str(caught.value)
    assert [p.name for p in tmp_path.iterdir()] == ["b.zip"]
    assert destination.read_bytes() == b"the old bundle"


def test_an_unwritable_destination_raises_an_environment_problem(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(EnvironmentProblem):
        write_bundle(reconstruction(), tmp_path / "file" / "b.zip", ExportConfig())


def test_a_cancelled_export_leaves_no_files(tmp_path: Path) -> None:
    with pytest.raises(Cancelled):
        write_bundle(reconstruction(), tmp_path / "b.zip", ExportConfig(), progress=Progress(is_cancelled=lambda: True))
    assert list(tmp_path.iterdir()) == []


def test_progress_increases_to_one(tmp_path: Path, small_preview: None) -> None:
    seen: list[float] = []
    channel = Progress(report=lambda stage, fraction, text: seen.append(fraction))
    write_bundle(one_drawer(), tmp_path / "b.zip", ExportConfig(pictures=False), progress=channel)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_an_empty_scene_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(ExportFailed):
        write_bundle(reconstruction(replace(kitchen(), objects=())), tmp_path / "b.zip", ExportConfig())


def test_source_date_epoch_sets_the_creation_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_preview: None) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    write_bundle(one_drawer(), tmp_path / "b.zip", ExportConfig(pictures=False, gripper=False))
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        assert json.loads(archive.read("manifest.json"))["created"] == "1970-01-01T00:00:00+00:00"


def test_an_unsafe_bundle_is_not_passed_to_any_loader(kitchen_bundle: tuple[Path, Certificate], tmp_path: Path) -> None:
    import shutil

    folder = tmp_path / "unsafe"
    shutil.copytree(kitchen_bundle[0].with_suffix(""), folder)
    scene = folder / "scene.xml"
    scene.write_text(scene.read_text().replace('file="assets', 'file="/assets', 1))
    certificate = check_bundle(folder)
    assert not certificate.passed
    assert {r.state for r in certificate.loaders} == {"not tried"}
    assert certificate_to_json(certificate)["drift_m"] is None


@pytest.mark.slow
def test_a_scene_of_fifteen_objects_is_certified(tmp_path: Path) -> None:
    from r2c2r_core.export.certify import certify
    from tests.core.export.conftest import write_folder

    objects = [cabinet(f"cabinet_{k}", x=0.6 * k) for k in range(10)] + [
        drawer(f"drawer_{k}", x=0.6 * k + 10) for k in range(5)
    ]
    scene = ArticulatedScene(name="t", objects=tuple(objects), layout_moves_m={}, warnings=())
    folder = write_folder(scene, tmp_path / "b")
    certificate = certify(folder)
    assert certificate.passed, certificate.findings
    assert len(certificate.joints) == 15


def test_the_certificate_as_json_is_versioned_and_complete(kitchen_bundle: tuple[Path, Certificate]) -> None:
    document = certificate_to_json(kitchen_bundle[1])
    assert document["version"] == 1
    assert set(document) == {
        "version",
        "passed",
        "likeness",
        "findings",
        "loaders",
        "joints",
        "things",
        "colliders",
        "rest_penetration_m",
        "together_penetration_m",
        "drift_m",
        "realtime_factor",
    }
    json.dumps(document, allow_nan=False)
