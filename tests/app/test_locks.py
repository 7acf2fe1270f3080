"""Locks of objects against changes: seen by everybody, kept by the server."""

from app.db.description import describe
from app.db.engine import reading, writing
from app.db.queries import project_row
from app.services import adopting
from tests.app.test_live import CLICK, listening, until
from tests.app.test_project_members import Kept, kept

__all__ = ["kept"]


def test_a_locked_object_is_not_changed_by_anybody_until_it_is_unlocked(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    alice, bob = kept.of["alice"], kept.of["bob"]
    number = alice.get(f"{at}/objects").json()[0]["id"]
    clicked = bob.post(f"{at}/objects/{number}/points?infer=false", json=CLICK).json()
    on, point = f"{at}/objects/{number}", f"{at}/objects/{number}/points/{clicked['points'][-1]['id']}"
    with listening(kept.web, kept.project) as socket:
        locked = alice.patch(on, json={"locked": True}).json()
        _, told = until(socket, type="object")
    assert (locked["locked_by"], told["object"]["locked_by"]) == ("alice", "alice")
    changes = [
        ("PATCH", on, {"name": "mine"}),
        ("PATCH", on, {"category": "oven"}),
        ("PATCH", on, {"assignee": "bob"}),
        ("PATCH", on, {"crop": None}),
        ("DELETE", on, None),
        ("POST", f"{on}/points", CLICK),
        ("POST", f"{on}/clicks", {"points": [CLICK]}),
        ("PATCH", point, {"x": 90.5}),
        ("DELETE", point, None),
        ("PUT", f"{on}/frames/3", {"mask": None}),  # not here
        ("DELETE", f"{on}/frames/3", None),
    ]
    for person in (alice, bob):
        for method, path, body in changes:
            refused = person.request(method, path, json=body)
            assert (refused.status_code, refused.json()["message"]) == (409, "drawer_1 is locked by alice"), (method, path)
            assert refused.json()["hint"] == "unlock it in the list of objects to change it"
    assert bob.get(f"{at}/objects").json()[0] == locked
    clicks = bob.get(f"{at}/figures").json()["clicks"]

    assert bob.patch(on, json={"locked": False}).json()["locked_by"] is None
    assert bob.patch(on, json={"name": "mine"}).json()["name"] == "mine"
    assert bob.get(f"{at}/figures").json()["clicks"] == clicks + 1  # of the new name: a lock is no click
    texts = [entry["text"] for entry in bob.get(f"{at}/history?limit=3").json()]
    assert texts == ["name of drawer_1 → mine", "drawer_1 unlocked", "drawer_1 locked"]


def test_locking_is_undone_and_redone(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    alice = kept.of["alice"]
    number = alice.get(f"{at}/objects").json()[0]["id"]
    alice.patch(f"{at}/objects/{number}", json={"name": "top"})
    alice.patch(f"{at}/objects/{number}", json={"locked": True})
    undone = alice.post(f"{at}/undo", json={}).json()
    assert (undone["text"], undone["object"]["locked_by"], undone["object"]["name"]) == ("top locked", None, "top")
    assert alice.post(f"{at}/redo", json={}).json()["object"]["locked_by"] == "alice"


def test_a_duplicate_and_a_folder_keep_locks(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    alice, context = kept.of["alice"], kept.web.context
    number = alice.get(f"{at}/objects").json()[0]["id"]
    alice.patch(f"{at}/objects/{number}", json={"locked": True})
    copy = alice.post(f"{at}/duplicate").json()["id"]
    assert [item["locked_by"] for item in alice.get(f"/api/projects/{copy}/objects").json()] == ["alice", None]
    with reading(context.engine) as session:
        row = project_row(session, kept.project)
        description = describe(session, row, context.files(row))
    alice.patch(f"{at}/objects/{number}", json={"locked": False})
    with writing(context.engine) as session:
        adopting.adopt(session, context.settings.data_dir, description, [], "root")
    assert [item["locked_by"] for item in alice.get(f"{at}/objects").json()] == ["alice", None]
