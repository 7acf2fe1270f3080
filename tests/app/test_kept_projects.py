"""Tags, archive and duplicates of projects, and the trash before deletion."""

import json
from pathlib import Path
from typing import Any

import pytest

from app.services import descriptions
from tests.app.conftest import Running

pytestmark = pytest.mark.both_databases


def clicks(web: Running, project: str) -> list[tuple[str, list[tuple[float, float]]]]:
    found = web.get(f"/api/projects/{project}/objects")
    return [(item["name"], [(point["x"], point["y"]) for point in item["points"]]) for item in found]


def test_a_trashed_project_is_hidden_and_restored_completely(web: Running) -> None:
    project = web.sample()
    before = clicks(web, project)
    drawer = web.get(f"/api/projects/{project}/objects")[0]["id"]
    assert web.delete(f"/api/projects/{project}")["counts"]["objects"] == 2
    assert web.get("/api/projects") == []
    for path in (f"/api/projects/{project}", f"/media/{project}/frames/3.jpg", f"/api/projects/{project}/objects"):
        assert web.client.get(path).status_code == 404
    web.patch(f"/api/projects/{project}/objects/{drawer}", {"name": "other"}, 404)
    (waits,) = web.get("/api/trash")
    assert (waits["id"], waits["name"], waits["who"]) == (project, "Sample kitchen", web.get("/api/system")["user"])
    assert web.post(f"/api/trash/{project}/restore", status=200)["name"] == "Sample kitchen"
    assert web.get("/api/trash") == []
    assert clicks(web, project) == before
    assert [entry["action"] for entry in web.get(f"/api/projects/{project}/history")[:2]] == ["restore", "trash"]


def test_only_projects_in_the_trash_are_deleted_permanently(web: Running) -> None:
    project = web.sample()
    web.delete(f"/api/trash/{project}", 404)
    web.post(f"/api/trash/{project}/restore", status=404)
    web.delete(f"/api/projects/{project}")
    web.delete(f"/api/trash/{project}")
    assert not (web.settings.data_dir / "projects" / project).exists()
    web.post(f"/api/trash/{project}/restore", status=404)


def test_tags_and_archiving_are_stored_and_recorded_in_the_history(web: Running) -> None:
    project = web.sample()
    changed = web.patch(f"/api/projects/{project}", {"tags": ["oak", "Flat 3", "oak"], "archived": True})
    assert (changed["tags"], changed["archived"]) == (["Flat 3", "oak"], True)
    (listed,) = web.get("/api/projects")
    assert (listed["tags"], listed["archived"]) == (["Flat 3", "oak"], True)
    texts = [entry["text"] for entry in web.get(f"/api/projects/{project}/history")[:2]]
    assert texts == ["archived", "tags: Flat 3, oak"]
    told = web.settings.data_dir / "projects" / project / "project.json"
    web.until(lambda: told.exists() and json.loads(told.read_text())["project"]["tags"] == ["Flat 3", "oak"])


def test_project_files_are_written_again_after_an_unexpected_error(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    project, failures, sound = web.sample(), list[str](), descriptions.describe

    def fail_once(session: Any, row: Any, files: Any) -> Any:
        if not failures:
            failures.append(row.id)
            raise ValueError("unexpected")
        return sound(session, row, files)

    monkeypatch.setattr(descriptions, "describe", fail_once)
    web.patch(f"/api/projects/{project}", {"tags": ["oak"]})
    web.until(lambda: failures)
    web.patch(f"/api/projects/{project}", {"tags": ["pine"]})
    told = web.settings.data_dir / "projects" / project / "project.json"
    web.until(lambda: told.exists() and json.loads(told.read_text())["project"]["tags"] == ["pine"])


def test_a_duplicate_is_an_independent_project(web: Running) -> None:
    project = web.sample()
    objects: list[dict[str, Any]] = web.get(f"/api/projects/{project}/objects")
    view = {"mode": "scene", "hidden": [objects[1]["name"]], "opacity": 0.5}
    web.post(f"/api/projects/{project}/comments", {"object": objects[0]["id"], "text": "a scratch", "view": view}, 201)
    web.post(f"/api/projects/{project}/lengths", {"object": objects[0]["id"], "side": "width", "metres": 0.505}, 201)
    between = [[0, 0, 0], [0, 1.0, 0]]
    measured = web.post(f"/api/projects/{project}/lengths", {"points_world": between, "metres": 1.01}, 201)["lengths"]
    masks = web.settings.data_dir / "projects" / project / "masks"
    for item in objects:
        (masks / str(item["id"])).mkdir(parents=True, exist_ok=True)
        (masks / str(item["id"]) / "mine").write_text(item["name"])
    copy = web.post(f"/api/projects/{project}/duplicate", status=201)
    assert (copy["name"], copy["status"], copy["review_state"]) == ("Sample kitchen (copy)", "ready", "draft")
    assert clicks(web, copy["id"]) == clicks(web, project)
    root = web.settings.data_dir / "projects" / copy["id"]
    copied = web.get(f"/api/projects/{copy['id']}/objects")
    assert {item["name"]: (root / "masks" / str(item["id"]) / "mine").read_text() for item in copied} == {
        item["name"]: item["name"] for item in objects
    }
    (comment,) = web.get(f"/api/projects/{copy['id']}/comments")
    assert comment["object"] == copied[0]["id"]
    assert comment["view"] == web.get(f"/api/projects/{project}/comments")[0]["view"]
    lengths = web.get(f"/api/projects/{copy['id']}/lengths")["lengths"]
    assert [one["object"] for one in lengths] == [copied[0]["id"], None]
    own = ("id", "object")
    assert [{k: v for k, v in one.items() if k not in own} for one in lengths] == [
        {k: v for k, v in one.items() if k not in own} for one in measured
    ]
    web.delete(f"/api/projects/{project}/objects/{objects[0]['id']}")
    web.delete(f"/api/projects/{project}")
    web.delete(f"/api/trash/{project}")
    assert len(clicks(web, copy["id"])) == 2
    assert Path(json.loads((root / "facts.json").read_text())["source"] or root).is_relative_to(root)
    assert web.client.get(f"/media/{copy['id']}/frames/3.jpg").status_code == 200
