"""Upload of a person's own mesh: accepted completely or not at all."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.services import mesh_uploads
from tests.app.conftest import Running, running
from tests.app.nouns import finish
from tests.app.test_imports import break_off
from tests.app.test_jobs import run
from tests.app.test_reviews import Reviewed
from tests.app.test_states import step


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reviewed]:
    """A project whose drawer_1 is finished."""
    with running(tmp_path_factory.mktemp("meshes") / "data") as web:
        project = web.sample()
        web.job(run(web, project), "done")
        finish(web.settings.data_dir / "projects" / project / "work")
        (drawer,) = [item for item in web.get(f"/api/projects/{project}/objects") if item["name"] == "drawer_1"]
        yield web, project, drawer["id"]


def address(project: str, number: int) -> str:
    return f"/api/projects/{project}/objects/{number}/candidates"


def send(web: Running, at: str, content: Any, status: int, name: str = "mine.glb", **query: Any) -> Any:
    asked = "&".join(f"{key}={value}" for key, value in {"filename": name, "rerun": "false", **query}.items())
    return web.post(f"{at}?{asked}", content=content, status=status)


def left_behind(web: Running, project: str) -> list[Path]:
    """Files and folders of uploaded meshes."""
    folders = (web.settings.uploads, web.settings.data_dir / "projects" / project / "uploads")
    return [path for folder in folders for path in folder.rglob("*") if path.is_file() or not any(path.iterdir())]


def test_uploaded_meshes_are_stored_under_unique_names(shared: Reviewed) -> None:
    web, project, number = shared
    before = left_behind(web, project)
    names = [
        send(web, address(project, number), b"glTF", 201, "../../m%C3%BCg.glb")["group"]["override"]["candidate"] for _ in "ab"
    ]
    kept = set(left_behind(web, project)) - set(before)
    assert sorted(path.name for path in kept) == sorted(set(names))  # the response contains only the file name
    for path in kept:
        assert path.is_relative_to(web.settings.data_dir / "projects" / project / "uploads")


def test_inspecting_a_mesh_reports_its_size_and_stores_nothing(shared: Reviewed) -> None:
    web, project, number = shared
    before = left_behind(web, project)
    at = f"/api/projects/{project}/objects/{number}"
    override = web.get(f"{at}/override")
    look = web.post(f"{at}/mesh-look?filename=mine.glb", content=b"glTF")
    assert (look["name"], look["size"], look["triangles"]) == ("mine.glb", [1.0, 0.6, 0.4], 12)
    assert look["notes"] == ["small holes were filled"]
    size_m = sorted(web.get(f"{at}/cloud")["size_m"], reverse=True)
    assert look["object_size_m"] == (size_m if any(size_m) else None)
    assert "no triangles found" in web.post(f"{at}/mesh-look?filename=x.glb", content=b"unreadable", status=422)["message"]
    assert "not a mesh" in web.post(f"{at}/mesh-look?filename=x.gltf", content=b"{}", status=422)["message"]
    assert left_behind(web, project) == before
    assert web.get(f"{at}/override") == override


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("x.exe", b"MZ", "not a mesh"),
        ("x.gltf", b"{}", "not a mesh"),  # its other files are not uploaded with it
        ("x.glb", b"", "empty"),
        ("x.glb", b"unreadable", "x.glb: no triangles found"),
    ],
)
def test_an_unusable_mesh_is_refused_and_leaves_no_files(shared: Reviewed, name: str, content: bytes, words: str) -> None:
    web, project, number = shared
    before = left_behind(web, project)
    refused = send(web, address(project, number), content, 422, name)
    assert (refused["kind"], words in refused["message"]) == ("override", True)
    assert left_behind(web, project) == before


def test_a_mesh_that_is_too_large_is_refused_and_leaves_no_files(shared: Reviewed, monkeypatch: pytest.MonkeyPatch) -> None:
    web, project, number = shared
    before = left_behind(web, project)
    monkeypatch.setattr(mesh_uploads, "MOST_BYTES", 100)
    assert send(web, address(project, number), (bytes(60) for _ in range(3)), 413)["kind"] == "too-large"
    assert left_behind(web, project) == before


def test_an_aborted_mesh_upload_leaves_no_files(shared: Reviewed) -> None:
    web, project, number = shared
    before = left_behind(web, project)
    said = break_off(web, "POST", address(project, number), b"half", query="filename=mine.glb")
    assert said[0]["status"] == 422
    assert left_behind(web, project) == before


def test_a_mesh_uploaded_for_an_outdated_version_is_refused(shared: Reviewed, monkeypatch: pytest.MonkeyPatch) -> None:
    web, project, number = shared
    before = left_behind(web, project)
    at = f"/api/projects/{project}/objects/{number}"
    seen = web.get(f"{at}/candidates")["version"]
    look = mesh_uploads.probing.look_at

    def meanwhile(*given: Any) -> Any:
        """Another person's correction of the object while the mesh is examined."""
        seen = look(*given)
        web.patch(f"{at}/override", {"hinge": "left", "rerun": False})
        return seen

    with monkeypatch.context() as patch:
        patch.setattr(mesh_uploads.probing, "look_at", meanwhile)
        late = send(web, f"{at}/candidates", b"glTF", 409, version=seen)
    assert late["current"]["override"]["hinge"] == "left"
    assert left_behind(web, project) == before
    assert send(web, f"{at}/candidates", b"glTF", 409, version=seen)["kind"] == "conflict"  # detected before the upload
    assert left_behind(web, project) == before
    now = web.get(f"{at}/candidates")["version"]
    assert send(web, f"{at}/candidates", b"glTF", 201, version=now)["group"]["version"] > now


def test_an_approved_project_rejects_mesh_uploads(shared: Reviewed) -> None:
    web, project, number = shared
    before = left_behind(web, project)
    for to in ("ready", "in review", "approved"):
        step(web, project, to, "it is time")
    assert "approved" in send(web, address(project, number), b"glTF", 409)["message"]
    assert left_behind(web, project) == before
    step(web, project, "changes requested", "for the next test")
