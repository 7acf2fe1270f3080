"""Collaboration: assignment of projects, each person's inbox, and changes by others since the last visit."""

import pytest

from app.db.description import describe
from app.db.engine import reading, writing
from app.db.queries import project_row
from app.services import adopting, inbox
from tests.app.nouns import finish
from tests.app.test_project_members import Kept, kept

__all__ = ["kept"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("@bob look", True),
        ("is it so, @Bob?", True),
        ("(@bob)", True),
        ("look, @bob.", True),
        ("@bobby", False),
        ("@bob-2", False),
        ("@bob.b", False),
        ("write to carol@bob", False),
        ("bob", False),
    ],
)
def test_a_mention_is_an_at_sign_followed_by_the_whole_name(text: str, said: bool) -> None:
    assert inbox.names("bob", text) is said


def of(kept: Kept, name: str) -> dict[str, list[dict[str, object]]]:
    found: dict[str, list[dict[str, object]]] = kept.of[name].get("/api/inbox").json()
    return found


def test_an_assigned_project_is_listed_for_an_assignee_who_may_see_it(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    given = kept.of["alice"].put(f"{at}/assignee", json={"name": "Bob"})
    assert given.json()["assignee"] == "bob"
    assert [row["id"] for row in of(kept, "bob")["assigned"]] == [kept.project]
    assert of(kept, "carol")["assigned"] == []
    assert "assigned to bob" in [row["text"] for row in kept.of["bob"].get(f"{at}/history").json()]
    kept.keep_to()
    assert of(kept, "bob")["assigned"] == []
    assert kept.of["alice"].get(f"{at}/people").json() == ["alice", "root"]
    refused = kept.of["alice"].put(f"{at}/assignee", json={"name": "carol"})
    assert (refused.status_code, refused.json()["message"]) == (422, "nobody called carol sees this project")
    assert kept.of["alice"].put(f"{at}/assignee", json={"name": None}).json()["assignee"] is None


def test_a_returned_project_is_listed_for_its_assignee_or_else_its_sender(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    for who, was, to in (("alice", "draft", "ready"), ("bob", "ready", "in review"), ("bob", "in review", "changes requested")):
        step = {"from_state": was, "to": to, "reason": "the hinge is on the wrong side"}
        assert kept.of[who].post(f"{at}/review", json=step).status_code == 200
    (row,) = of(kept, "alice")["returned"]
    assert (row["who"], row["reason"]) == ("bob", "the hinge is on the wrong side")
    kept.of["bob"].put(f"{at}/assignee", json={"name": "carol"})
    assert of(kept, "alice")["returned"] == []
    assert [row["id"] for row in of(kept, "carol")["returned"]] == [kept.project]
    assert of(kept, "carol")["assigned"] == []  # each project is in one list only
    kept.of["bob"].patch(at, json={"archived": True})
    assert of(kept, "carol")["returned"] == []


def test_a_mention_is_in_the_inbox_until_its_comment_is_resolved(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}/comments"
    number = kept.of["alice"].post(at, json={"text": "is this a door, @bob?"}).json()["id"]
    kept.of["bob"].post(at, json={"text": "yes, says @bob; not @bobby"})  # Bob's own comment
    (row,) = of(kept, "bob")["mentions"]
    assert row["comment"]["text"] == "is this a door, @bob?"  # type: ignore[index]
    assert of(kept, "alice")["mentions"] == []
    kept.of["carol"].patch(f"{at}/{number}", json={"resolved": True})
    assert of(kept, "bob")["mentions"] == []


def test_news_are_changes_by_others_since_the_last_visit_or_own_change(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    carol = kept.of["carol"]
    first = carol.get(f"{at}/news").json()
    assert first["since"] is None
    assert first["entries"] == []
    carol.put(f"{at}/news", json={"event": first["last"]})
    kept.of["alice"].post(f"{at}/comments", json={"text": "one"})
    kept.of["bob"].post(f"{at}/comments", json={"text": "two"})
    kept.of["bob"].post(f"{at}/comments", json={"text": "three"})
    told = carol.get(f"{at}/news").json()
    assert [entry["text"] for entry in told["entries"]] == ["commented: three", "commented: two", "commented: one"]
    assert told["people"] == [{"who": "bob", "changes": 2}, {"who": "alice", "changes": 1}]
    assert carol.get(f"{at}/news").json() == told  # reading it again removes nothing
    assert carol.put(f"{at}/news", json={"event": told["last"]}).json()["entries"] == []
    assert [entry["text"] for entry in kept.of["alice"].get(f"{at}/news").json()["entries"]] == [
        "commented: three",
        "commented: two",
    ]


def test_an_older_read_marker_does_not_bring_old_news_back(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}/news"
    kept.of["alice"].post(f"/api/projects/{kept.project}/comments", json={"text": "one"})
    last = kept.of["carol"].get(at).json()["last"]
    kept.of["carol"].put(at, json={"event": last})
    assert kept.of["carol"].put(at, json={"event": 0}).json()["entries"] == []


def test_a_project_folder_stores_the_assignee_of_the_project(kept: Kept) -> None:
    kept.of["alice"].put(f"/api/projects/{kept.project}/assignee", json={"name": "bob"})
    context = kept.web.context
    with reading(context.engine) as session:
        row = project_row(session, kept.project)
        description = describe(session, row, context.files(row))
    assert description.assignee == "bob"
    assert "assignee_id" not in description.project
    with writing(context.engine) as session:
        project_row(session, kept.project).assignee_id = None
        adopting.adopt(session, context.settings.data_dir, description, [], "root")
    assert kept.of["bob"].get(f"/api/projects/{kept.project}").json()["assignee"] == "bob"


def test_an_assigned_object_is_in_the_inbox_while_its_project_is_open(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    first, second = kept.of["alice"].get(f"{at}/objects").json()
    given = kept.of["alice"].patch(f"{at}/objects/{first['id']}", json={"assignee": "Bob", "version": first["version"]})
    assert (given.json()["assignee"], given.json()["points"]) == ("bob", first["points"])
    (row,) = of(kept, "bob")["objects"]
    assert (row["object"], row["name"], row["category"]) == (first["id"], "drawer_1", "drawer")
    assert (row["project"], row["project_name"]) == (kept.project, kept.of["bob"].get(at).json()["name"])
    assert of(kept, "alice")["objects"] == []
    assert kept.of["alice"].get(f"{at}/figures").json()["clicks"] == 0  # assigning is not a click
    refused = kept.of["alice"].patch(f"{at}/objects/{second['id']}", json={"assignee": "nobody-here"})
    assert (refused.status_code, refused.json()["message"]) == (422, "nobody called nobody-here sees this project")

    undone = kept.of["bob"].post(f"{at}/undo", json={"object": first["id"]}).json()
    assert (undone["text"], undone["object"]["assignee"]) == ("drawer_1 assigned to bob", None)
    assert of(kept, "bob")["objects"] == []
    kept.of["bob"].post(f"{at}/redo", json={"object": first["id"]})
    assert len(of(kept, "bob")["objects"]) == 1
    renamed = kept.of["bob"].patch(f"{at}/objects/{first['id']}", json={"name": "top_drawer"}).json()
    assert renamed["assignee"] == "bob"  # omitted fields are unchanged
    kept.keep_to()
    assert of(kept, "bob")["objects"] == []  # people without access to the project get no entry
    kept.keep_to("bob")
    kept.of["alice"].delete(f"{at}/objects/{first['id']}")
    assert of(kept, "bob")["objects"] == []


def test_candidates_in_review_show_the_assignee_of_their_object(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    number = kept.of["alice"].get(f"{at}/objects").json()[0]["id"]
    finish(kept.web.settings.data_dir / "projects" / kept.project / "work")
    kept.of["alice"].patch(f"{at}/objects/{number}", json={"assignee": "bob"})
    (group,) = kept.of["bob"].get(f"{at}/candidates").json()
    assert (group["object"], group["assignee"]) == (number, "bob")


def test_removing_an_account_clears_its_assignments(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}/objects"
    number = kept.of["alice"].get(at).json()[0]["id"]
    kept.of["alice"].patch(f"{at}/{number}", json={"assignee": "carol"})
    kept.of["root"].delete("/api/accounts/carol")
    assert kept.of["alice"].get(at).json()[0]["assignee"] is None


def test_a_folder_stores_object_assignees_and_a_duplicate_has_none(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    number = kept.of["alice"].get(f"{at}/objects").json()[0]["id"]
    kept.of["alice"].patch(f"{at}/objects/{number}", json={"assignee": "bob"})
    copy = kept.of["alice"].post(f"{at}/duplicate").json()["id"]
    assert {item["assignee"] for item in kept.of["alice"].get(f"/api/projects/{copy}/objects").json()} == {None}
    context = kept.web.context
    with reading(context.engine) as session:
        row = project_row(session, kept.project)
        description = describe(session, row, context.files(row))
    kept.of["alice"].patch(f"{at}/objects/{number}", json={"assignee": None})
    description.objects[1].assignee = "stranger"  # an account of another server
    with writing(context.engine) as session:
        adopting.adopt(session, context.settings.data_dir, description, [], "root")
    assert [item["assignee"] for item in kept.of["alice"].get(f"{at}/objects").json()] == ["bob", None]
