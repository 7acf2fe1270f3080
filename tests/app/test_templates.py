"""Templates of objects to click: stored on the server, and adopted by projects."""

from typing import Any

from app.db.description import describe
from app.db.engine import reading, writing
from app.db.queries import project_row
from app.services import adopting
from tests.app.conftest import Running
from tests.app.test_project_members import Kept, kept

__all__ = ["kept"]

OBJECTS = [{"name": "drawer_1", "category": "drawer"}, {"name": "oven_1", "category": "oven"}]


def test_an_adopted_checklist_is_kept_when_its_template_changes(web: Running) -> None:
    project = web.sample()
    template = web.post("/api/templates", {"name": "Flat 3", "objects": OBJECTS}, 201)
    at = f"/api/projects/{project}"
    taken = web.client.put(f"{at}/checklist", json={"template": template["id"]}).json()
    assert taken["checklist"] == OBJECTS
    assert taken["counts"]["objects"] == 2  # a list creates no objects
    changed = {"name": "Flat 4", "objects": OBJECTS[1:]}
    assert web.client.put(f"/api/templates/{template['id']}", json=changed).json()["objects"] == OBJECTS[1:]
    assert web.get(at)["checklist"] == OBJECTS
    assert web.client.delete(f"/api/templates/{template['id']}").status_code == 204
    assert web.get(at)["checklist"] == OBJECTS
    assert web.get("/api/templates") == []
    assert web.client.put(f"{at}/checklist", json={"template": None}).json()["checklist"] == []
    assert [row["text"] for row in web.get(f"{at}/history") if row["action"] == "checklist"] == [
        "no list of objects to click",
        "2 objects to click, from the template Flat 3",
    ]
    refused = web.client.put(f"{at}/checklist", json={"template": template["id"]})
    assert (refused.status_code, refused.json()["kind"]) == (404, "not-found")


def test_object_names_of_a_template_must_be_valid_and_unique(web: Running) -> None:
    def refused(objects: list[dict[str, str]]) -> str:
        return str(web.post("/api/templates", {"name": "Flat", "objects": objects}, 422)["message"])

    assert refused([{"name": "top drawer", "category": "drawer"}]) == "the name 'top drawer' is not usable"
    assert refused([*OBJECTS, {"name": "Oven_1", "category": "oven"}]) == "two objects named 'Oven_1'"
    assert "objects" in refused([])
    web.post("/api/templates", {"name": "Flat", "objects": OBJECTS}, 201)
    assert web.post("/api/templates", {"name": "Flat", "objects": OBJECTS}, 409)["kind"] == "conflict"


def test_anyone_uses_a_template_but_only_owner_or_admin_changes_it(kept: Kept) -> None:
    made = kept.of["alice"].post("/api/templates", json={"name": "Flat", "objects": OBJECTS}).json()

    def may(name: str) -> list[Any]:
        return [row["may_change"] for row in kept.of[name].get("/api/templates").json()]

    assert (may("alice"), may("bob"), may("root")) == ([True], [False], [True])
    at = f"/api/templates/{made['id']}"
    refused = kept.of["bob"].put(at, json={"name": "Mine", "objects": OBJECTS})
    assert (refused.status_code, refused.json()["message"]) == (403, "the template Flat belongs to alice")
    assert kept.of["bob"].delete(at).status_code == 403
    taken = kept.of["bob"].put(f"/api/projects/{kept.project}/checklist", json={"template": made["id"]})
    assert taken.json()["checklist"] == OBJECTS
    assert kept.of["root"].delete(at).status_code == 204


def test_a_duplicate_and_a_project_folder_keep_the_checklist(web: Running) -> None:
    project = web.sample()
    template = web.post("/api/templates", {"name": "Flat 3", "objects": OBJECTS}, 201)
    web.client.put(f"/api/projects/{project}/checklist", json={"template": template["id"]})
    copy = web.post(f"/api/projects/{project}/duplicate")
    assert copy["checklist"] == OBJECTS
    with reading(web.context.engine) as session:
        row = project_row(session, project)
        description = describe(session, row, web.context.files(row))
    web.client.put(f"/api/projects/{project}/checklist", json={"template": None})
    with writing(web.context.engine) as session:
        adopting.adopt(session, web.context.settings.data_dir, description, [], "tester")
    assert web.get(f"/api/projects/{project}")["checklist"] == OBJECTS
