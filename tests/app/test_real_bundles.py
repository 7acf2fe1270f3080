"""Every address that reads a bundle, asked about bundles as the exporter writes them."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from r2c2r_core.export import stage
from r2c2r_core.export.stage import ExportConfig, write_bundle
from r2c2r_core.model.report import Certificate
from tests.app.conftest import Running, running
from tests.app.finished import finished_kitchen
from tests.core.export.kitchen import kitchen, reconstruction

WANTS = {
    "project": "{project}",
    "object": 1,
    "job": 1,
    "frame": 7,
    "version": 1,
    "candidate": "c0",
    "side": "plan",
    "elevation": "e0",
}


@pytest.fixture(scope="module")
def shorter_bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The kitchen with a drawer less."""
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
    with running(tmp_path_factory.mktemp("app") / "data") as web:
        yield web, finished_kitchen(web, kitchen_bundle[1], shorter_bundle, kitchen_bundle[0])


def readers(web: Running, project: str) -> list[tuple[str, str]]:
    """Every GET operation of the API with its address here."""
    found = []
    for path, operations in web.app.openapi()["paths"].items():
        if "get" in operations:
            address = path.format_map({**WANTS, "project": project, "comment": 1, "upload": "0"})
            found.append((operations["get"]["operationId"], address))
    return found


def test_what_changed_is_said_of_kitchens_with_something_made_from_the_scan(made: tuple[Running, str]) -> None:
    web, project = made
    said = web.get(f"/api/projects/{project}/bundles/2/changes?since=1")
    assert {"object": "drawer_1", "text": "new: drawer"} in said
    assert web.get(f"/api/projects/{project}/bundles/2/changes?since=2") == []


def test_every_address_answers_about_a_real_bundle(made: tuple[Running, str]) -> None:
    web, project = made
    answers = {name: web.client.get(address) for name, address in readers(web, project) if name != "compareBundles"}
    assert [f"{name}: {answer.text}" for name, answer in answers.items() if answer.status_code >= 500] == []
    about_bundles = (
        "getScene getCertificate listBundles checkBundle listCandidates sceneMesh scenePicture sceneReport sceneReview"
    )
    for name in [*about_bundles.split(), "downloadBundle", "candidateMesh", "overlayPicture", "getPhotos"]:
        assert answers[name].status_code == 200, f"{name}: {answers[name].text}"
    assert answers["checkBundle"].json() == {"version": 1, "intact": True, "findings": []}


def test_the_scene_table_tells_everything_in_it(made: tuple[Running, str]) -> None:
    web, project = made
    scene = web.get(f"/api/projects/{project}/scene")
    items = {item["name"]: item for item in scene["items"]}
    assert items["counter_1"]["mask_frames"] == 0
    assert items["counter_1"]["placement_rms_m"] is None
    assert items["drawer_1"]["placement_rms_m"] == 0.004
    assert scene["failures"] == {}


@pytest.mark.parametrize("mode", ["cloud", "candidate", "aligned", "scene"])
def test_what_the_3d_view_is_asked_to_show_can_be_read(
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
