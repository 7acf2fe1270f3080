"""Second opinions: two people annotate one recording independently, and their objects are compared."""

import csv
import io
from typing import Any

from app.db.description import describe
from app.db.engine import reading
from app.db.queries import project_row
from tests.app.test_project_members import Kept, kept

__all__ = ["kept"]


def ask(kept: Kept, name: str | None = "bob") -> str:
    return str(kept.of["alice"].post(f"/api/projects/{kept.project}/opinions", json={"name": name}).json()["id"])


def click(kept: Kept, project: str, name: str, category: str, x: float) -> None:
    """An object whose masks are a square of 10 pixels around the click, in each of the three frames."""
    body = {"name": name, "category": category, "points": [{"frame": 3, "x": x, "y": 60}]}
    number = kept.of["root"].post(f"/api/projects/{project}/objects", json=body).json()["id"]

    def done() -> bool:
        items = kept.of["root"].get(f"/api/projects/{project}/objects").json()
        return any(item["id"] == number and item["segment"] == "done" for item in items)

    kept.web.until(done)


def test_a_second_opinion_has_the_recording_without_any_annotations(kept: Kept) -> None:
    at = f"/api/projects/{kept.project}"
    kept.of["alice"].post(f"{at}/comments", json={"text": "the hinge is on the left"})
    made = kept.of["alice"].post(f"{at}/opinions", json={"name": "Bob"}).json()
    assert (made["name"], made["assignee"], made["status"]) == ("Sample kitchen (opinion of bob)", "bob", "ready")
    assert (made["counts"]["objects"], made["counts"]["open_comments"], made["review_state"]) == (0, 0, "draft")
    there = f"/api/projects/{made['id']}"
    assert kept.of["bob"].get(f"{there}/frames").json() == kept.of["bob"].get(f"{at}/frames").json()
    assert kept.of["bob"].get(f"/media/{made['id']}/frames/3.jpg").status_code == 200
    assert kept.of["bob"].get(f"{there}/objects?deleted=true").json() == []
    assert [row["id"] for row in kept.of["bob"].get("/api/inbox").json()["assigned"]] == [made["id"]]
    root = kept.web.settings.data_dir / "projects" / made["id"]
    assert not (root / "masks").exists()
    assert [path.name for path in (root / "work").rglob("nouns/*")] in ([], ["ingest"])
    refused = kept.of["alice"].post(f"{at}/opinions", json={"name": "stranger"})
    assert (refused.status_code, refused.json()["message"]) == (422, "nobody called stranger sees this project")


def test_agreement_is_reported_by_object_with_unmatched_objects(kept: Kept) -> None:
    other = ask(kept)
    for item in kept.of["alice"].get(f"/api/projects/{kept.project}/objects").json():
        kept.of["alice"].delete(f"/api/projects/{kept.project}/objects/{item['id']}")
    click(kept, kept.project, "top", "cabinet", 60)
    click(kept, kept.project, "jar", "bottle", 100)
    click(kept, kept.project, "left_door", "cabinet", 20)
    click(kept, other, "drawer_1", "door", 62)
    click(kept, other, "oven_1", "oven", 20)
    kept.of["bob"].post(f"/api/projects/{other}/objects", json={"name": "waits", "category": "mug"})
    found: dict[str, Any] = kept.of["carol"].get(f"/api/projects/{kept.project}/opinions/{other}").json()
    assert [found[key] for key in ("both", "only_first", "only_second", "same_category", "frames")] == [2, 1, 0, 1, 3]
    assert [one["name"] for one in found["unmasked"]] == ["waits"]
    lone, moved, same = found["objects"]  # the largest disagreement is first
    assert (lone["first"]["name"], lone["second"], lone["iou"]) == ("jar", None, None)
    assert (moved["first"]["name"], moved["second"]["name"], moved["same_category"]) == ("top", "drawer_1", True)
    assert (moved["iou"], moved["frames"]) == (80 / 120, 3)  # each has two columns of ten to itself
    assert (same["iou"], same["same_category"], same["second"]["name"]) == (1.0, False, "oven_1")
    assert found["mean_iou"] == (80 / 120 + 1.0) / 2
    assert (found["first"]["project"], found["second"]["assignee"]) == (kept.project, "bob")
    turned = kept.of["bob"].get(f"/api/projects/{other}/opinions/{kept.project}").json()
    assert (turned["only_second"], turned["mean_iou"]) == (1, found["mean_iou"])

    answer = kept.of["bob"].get(f"/api/projects/{kept.project}/opinions/{other}/agreement.csv")
    assert "attachment" in answer.headers["content-disposition"]
    lines = list(csv.DictReader(io.StringIO(answer.text)))
    assert [line["first object"] for line in lines] == ["jar", "top", "left_door"]
    assert (lines[1]["mask IoU"], lines[1]["same category"], lines[0]["second object"]) == ("0.667", "yes", "")


def test_opinions_list_the_others_that_the_person_may_see(kept: Kept) -> None:
    second, third = ask(kept), ask(kept, None)
    of_copy = kept.of["bob"].post(f"/api/projects/{second}/opinions", json={"name": "carol"}).json()["id"]
    copy = kept.of["bob"].post(f"/api/projects/{second}/duplicate").json()["id"]  # a copy is not an opinion

    def others(project: str, by: str = "root") -> set[str]:
        return {row["project"] for row in kept.of[by].get(f"/api/projects/{project}/opinions").json()}

    assert others(kept.project) == {second, third, of_copy}
    assert others(third) == {kept.project, second, of_copy}
    assert others(copy) == set()
    at = f"/api/projects/{third}/opinions/{kept.project}"
    assert kept.of["carol"].get(at).status_code == 200
    kept.keep_to("bob")
    assert others(third, "carol") == {second, of_copy}
    assert kept.of["carol"].get(at).status_code == kept.of["carol"].get(f"{at}/agreement.csv").status_code == 404
    assert kept.of["carol"].get(f"/api/projects/{third}/opinions/{copy}").status_code == 404
    kept.of["root"].delete(f"/api/projects/{second}")
    assert others(third) == {kept.project, of_copy}
    context = kept.web.context
    with reading(context.engine) as session:
        row = project_row(session, third)
        assert describe(session, row, context.files(row)).project["opinion_of"] == kept.project
