"""Every endpoint that reads a bundle, with bundles from the real exporter."""

import io
import re
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.jobs.plans import Commands
from app.services.bundle_inside import trial
from r2c2r_core.export import stage
from r2c2r_core.export.stage import ExportConfig, write_bundle
from r2c2r_core.model.report import Certificate
from tests.app.conftest import FAKE_COMMANDS, Running, running
from tests.app.finished import finished_kitchen
from tests.core.export.kitchen import kitchen, reconstruction

WANTS = {
    "project": "{project}",
    "object": 1,
    "job": 1,
    "frame": 7,
    "version": 1,
    "template": 1,
    "other": "0",
    "candidate": "c0",
    "side": "plan",
    "elevation": "e0",
    "webhook": 1,
    "folder": "gripper",
    "picture": "cabinet_1_hinge.jpg",
    "object_name": "cabinet_1",
    "variants_name": "v2-n3-s7",
}


@pytest.fixture(scope="module")
def shorter_bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The kitchen without one drawer."""
    scene = kitchen()
    path = tmp_path_factory.mktemp("shorter") / "bundle.zip"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stage, "preview_png", lambda *_: b"not looked at")
        less = replace(scene, objects=tuple(item for item in scene.objects if item.name != "drawer_1"))
        write_bundle(reconstruction(less), path, ExportConfig(pictures=False))
    return path


@pytest.fixture(scope="module")
def made(
    tmp_path_factory: pytest.TempPathFactory, kitchen_bundle: tuple[Path, Certificate], shorter_bundle: Path
) -> Iterator[tuple[Running, str]]:
    """An app with a project whose two bundles and nouns are those of the small kitchen."""
    with running(tmp_path_factory.mktemp("app") / "data", replace(FAKE_COMMANDS, vary=Commands().vary)) as web:
        yield web, finished_kitchen(web, kitchen_bundle[1], shorter_bundle, kitchen_bundle[0])


def readers(web: Running, project: str) -> list[tuple[str, str]]:
    """Every GET operation of the API, with its path here."""
    found = []
    for path, operations in web.app.openapi()["paths"].items():
        if "get" in operations:
            address = path.format_map({**WANTS, "project": project, "comment": 1, "upload": "0"})
            found.append((operations["get"]["operationId"], address))
    return found


def test_changes_between_bundles_list_a_new_object(made: tuple[Running, str]) -> None:
    web, project = made
    said = web.get(f"/api/projects/{project}/bundles/2/changes?since=1")
    assert {"object": "drawer_1", "text": "new: drawer"} in said
    assert web.get(f"/api/projects/{project}/bundles/2/changes?since=2") == []


def test_every_endpoint_that_reads_a_bundle_answers(made: tuple[Running, str]) -> None:
    web, project = made
    answers = {name: web.client.get(address) for name, address in readers(web, project) if name != "compareBundles"}
    assert [f"{name}: {answer.text}" for name, answer in answers.items() if answer.status_code >= 500] == []
    about_bundles = (
        "getScene getCertificate listBundles checkBundle listCandidates sceneMesh scenePicture"
        " sceneReport sceneReadme sceneReview"
    )
    for name in [*about_bundles.split(), "downloadBundle", "candidateMesh", "overlayPicture", "getPhotos"]:
        assert answers[name].status_code == 200, f"{name}: {answers[name].text}"
    assert answers["checkBundle"].json() == {"version": 1, "intact": True, "findings": []}


def test_the_scene_table_includes_objects_without_masks(made: tuple[Running, str]) -> None:
    web, project = made
    scene = web.get(f"/api/projects/{project}/scene")
    items = {item["name"]: item for item in scene["items"]}
    assert items["counter_1"]["mask_frames"] == 0
    assert items["counter_1"]["placement_rms_m"] is None
    assert items["drawer_1"]["placement_rms_m"] == 0.004
    assert scene["failures"] == {}


@pytest.mark.parametrize("mode", ["cloud", "candidate", "aligned", "scene"])
def test_every_mode_of_the_3d_view_is_passed_to_the_viewer(
    made: tuple[Running, str], monkeypatch: pytest.MonkeyPatch, mode: str
) -> None:
    web, project = made
    wishes: list[dict[str, Any]] = []

    def show(*wish: Any) -> dict[str, Any]:
        wishes.append(wish[-1])
        return {"mode": mode, "text": "", "joints": []}

    shown: Callable[..., Any] = show
    monkeypatch.setattr(type(web.context.viewer), "show", lambda _, *wish: shown(*wish))
    web.post(f"/api/projects/{project}/viewer/show", {"mode": mode, "object": 1})
    assert wishes


def test_the_contents_of_a_bundle_list_assets_robots_and_simulators(made: tuple[Running, str]) -> None:
    web, project = made
    inside = web.get(f"/api/projects/{project}/bundles/2/inside")
    assert {asset["name"] for asset in inside["assets"]} == {"cabinet_1", "drawer_1", "double_1", "counter_1", "bottle_1"}
    assert inside["assets"][0]["formats"] == [".glb", ".urdf", ".usda", ".xml"]
    (gripper,) = inside["robots"]
    assert (gripper["joints"], gripper["joints_opened"], gripper["map"]) == (4, 4, None)
    sheet = web.client.get(next(grip["picture"] for grip in gripper["grips"] if grip["name"] == "drawer_1_slide"))
    assert (sheet.status_code, sheet.headers["content-type"]) == (200, "image/jpeg")
    assert web.client.get(f"/media/{project}/gripper/drawer_1_slide.jpg").content == sheet.content  # as report.html requests
    for link in re.findall(r'href="([^":#]+)"', web.client.get(f"/media/{project}/report.html").text):
        assert web.client.get(f"/media/{project}/{link}").status_code == 200, link
    assert "MuJoCo" in {lines["simulator"] for lines in inside["simulators"]}


def test_the_reason_of_a_failed_robot_trial_is_shown() -> None:
    found = trial("An arm", "arm", {"why": "scene.xml: MuJoCo cannot load it"}, "/media/p/bundles/1")
    assert found is not None
    assert (found.name, found.why, found.grips) == ("An arm", "scene.xml: MuJoCo cannot load it", [])


def test_a_single_downloaded_object_loads_in_mujoco_with_its_texture(made: tuple[Running, str], tmp_path: Path) -> None:
    import mujoco

    web, project = made
    answer = web.client.get(f"/media/{project}/bundles/2/objects/drawer_1.zip")
    zipfile.ZipFile(io.BytesIO(answer.content)).extractall(tmp_path)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "assets" / "drawer_1" / "drawer_1.xml"))
    assert (model.njnt, model.ntex) == (1, 1)
    assert {path.parts[1] for file in tmp_path.rglob("*.*") for path in [file.relative_to(tmp_path)]} == {"drawer_1"}
    assert web.client.get(f"/media/{project}/bundles/2/objects/fridge.zip").json()["kind"] == "not-found"


@pytest.mark.slow
def test_variants_of_one_seed_are_identical_and_load_in_mujoco(made: tuple[Running, str], tmp_path: Path) -> None:
    import mujoco

    web, project = made
    at = f"/api/projects/{project}/variants"
    offer = web.get(at)["offer"]
    files = web.settings.data_dir / "projects" / project / "variants" / "v2-n3-s7"
    digests = set()
    for _ in range(2):
        job = web.job(web.post(at, {"version": 2, "count": 3, "seed": 7}, 202)["id"], "done", "failed")
        assert (job["state"], job["error"]) == ("done", None)
        (found,) = web.get(at)["sets"]
        digests.add(found["sha256"])
        answer = web.client.get(found["url"])
        assert f'filename="{found["file_name"]}"' in answer.headers["content-disposition"]
        assert len(answer.content) == found["size"]
        assert (found["checked"], found["failed"]) == (3, [])
        wall = web.client.get(found["wall"])
        assert (wall.status_code, wall.headers["content-type"]) == (200, "image/jpeg")
        assert {path.name for path in files.iterdir()} == {"variants.zip", "wall.jpg", "facts.json"}
        web.delete(f"{at}/v2-n3-s7")
        assert not files.exists()
    assert len(digests) == 1
    # the offer includes the fixed parts; within two thirds and three halves, as pictures of bundles compress differently
    promised = offer["zip_bytes"] + 3 * offer["each_zip_bytes"]
    assert 0.67 * found["size"] < promised < 1.5 * found["size"]
    zipfile.ZipFile(io.BytesIO(answer.content)).extractall(tmp_path)
    taken = sum(path.stat().st_size for path in tmp_path.rglob("*") if path.is_file())
    assert 0.67 * taken < offer["disk_bytes"] + 3 * offer["each_disk_bytes"] < 1.5 * taken
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "variants" / "00002.xml")).njnt > 0
    assert not {"gripper", "arm", "pictures"} & {path.name for path in (tmp_path / "base").iterdir()}
