from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from app.db import queries
from app.db.engine import writing
from tests.app.conftest import Running
from tests.app.people import signed_in, with_accounts

pytestmark = pytest.mark.both_databases


CLICK = {"frame": 3, "x": 80.5, "y": 60.5, "label": 1}


def test_clicks_are_stored_and_can_be_undone_and_redone_after_a_restart(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]}, 201)
        assert made["name"] == "drawer_2"
        number = made["id"]
        web.post(f"/api/projects/{project}/objects/{number}/points", {**CLICK, "x": 20.0, "label": 0}, 201)
        edited = web.patch(f"/api/projects/{project}/objects/{number}", {"name": "top_drawer", "category": "cabinet"})
        assert (edited["name"], edited["category"], len(edited["points"])) == ("top_drawer", "cabinet", 2)
        undone = web.post(f"/api/projects/{project}/undo", {"object": number})
        assert undone["object"]["name"] == "drawer_2"
    with start() as web:
        (kept,) = [o for o in web.get(f"/api/projects/{project}/objects") if o["id"] == number]
        assert (kept["name"], len(kept["points"]), kept["can_undo"], kept["can_redo"]) == ("drawer_2", 2, True, True)
        undone = web.post(f"/api/projects/{project}/undo", {"object": number})
        assert (len(undone["object"]["points"]), undone["frame"]) == (1, 3)
        redone = web.post(f"/api/projects/{project}/redo", {"object": number})
        assert [p["id"] for p in redone["object"]["points"]] == [p["id"] for p in kept["points"]]
        redone = web.post(f"/api/projects/{project}/redo", {"object": number})
        assert redone["object"]["name"] == "top_drawer"
        web.post(f"/api/projects/{project}/redo", {"object": number}, 409)


def test_undo_of_an_outdated_version_is_a_conflict(web: Running) -> None:
    project = web.sample()
    item = web.get(f"/api/projects/{project}/objects")[0]
    at = f"/api/projects/{project}/objects/{item['id']}"
    seen = web.post(f"{at}/points", {"frame": 3, "x": 20, "y": 20})["version"]
    renamed = web.patch(at, {"name": "of_somebody_else"})
    refused = web.post(f"/api/projects/{project}/undo", {"object": item["id"], "version": seen}, 409)
    assert (refused["kind"], refused["current"]["name"]) == ("conflict", "of_somebody_else")
    undone = web.post(f"/api/projects/{project}/undo", {"object": item["id"], "version": renamed["version"]})
    assert undone["version"] == undone["object"]["version"] > renamed["version"]


def test_undo_without_an_object_reverts_the_last_change_of_any_object(web: Running) -> None:
    project = web.sample()
    first, second = (o["id"] for o in web.get(f"/api/projects/{project}/objects"))
    web.post(f"/api/projects/{project}/objects/{first}/points", CLICK, 201)
    web.post(f"/api/projects/{project}/objects/{second}/points", CLICK, 201)
    web.patch(f"/api/projects/{project}/objects/{first}", {"category": "oven"})
    assert web.post(f"/api/projects/{project}/undo", {})["object"]["id"] == first
    assert web.post(f"/api/projects/{project}/undo", {})["object"]["id"] == second
    assert web.post(f"/api/projects/{project}/redo", {})["object"]["id"] == second
    assert web.post(f"/api/projects/{project}/redo", {})["object"]["category"] == "oven"


def test_undo_without_an_object_reverts_ones_own_last_change(tmp_path: Path) -> None:
    with with_accounts(tmp_path / "data") as web, signed_in(web, "the-annotator") as ann, signed_in(web, "the-reviewer") as bea:
        project = ann.post("/api/projects/sample", json={}).json()["id"]
        at = f"/api/projects/{project}"
        for name in ("mine", "ours"):
            assert ann.post(f"{at}/objects", json={"name": name, "category": "mug"}).status_code == 201
        assert bea.post(f"{at}/objects", json={"name": "hers", "category": "mug"}).status_code == 201
        ours = next(item["id"] for item in ann.get(f"{at}/objects").json() if item["name"] == "ours")
        assert bea.patch(f"{at}/objects/{ours}", json={"category": "bottle"}).status_code == 200
        assert ann.post(f"{at}/undo", json={}).json()["text"] == "added mine"  # hers are newer, and ours is hers since
        assert bea.post(f"{at}/undo", json={}).json()["object"]["name"] == "ours"
        assert ann.post(f"{at}/redo", json={}).json()["text"] == "added mine"


def test_a_new_change_clears_the_redo_stack(web: Running) -> None:
    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    web.post(f"/api/projects/{project}/objects/{number}/points", CLICK, 201)
    web.post(f"/api/projects/{project}/undo", {"object": number})
    changed = web.patch(f"/api/projects/{project}/objects/{number}", {"category": "oven"})
    assert not changed["can_redo"]
    web.post(f"/api/projects/{project}/redo", {"object": number}, 409)


def test_undo_restores_a_deleted_object_completely(web: Running) -> None:
    project = web.sample()
    before = web.get(f"/api/projects/{project}/objects")[0]
    assert web.delete(f"/api/projects/{project}/objects/{before['id']}")["deleted"]
    assert len(web.get(f"/api/projects/{project}/objects")) == 1
    back = web.post(f"/api/projects/{project}/undo", {"object": before["id"]})["object"]
    assert (back["name"], back["points"], back["deleted"]) == (before["name"], before["points"], False)


def test_undoing_a_deletion_with_a_reused_name_is_a_conflict(web: Running) -> None:
    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    web.delete(f"/api/projects/{project}/objects/{number}")
    web.post(f"/api/projects/{project}/objects", {"name": "drawer_1", "category": "drawer"}, 201)
    error = web.post(f"/api/projects/{project}/undo", {"object": number}, 409)
    assert "drawer_1" in error["message"]


@pytest.mark.both_databases(quick=False)
def test_points_are_moved_relabelled_and_deleted(web: Running) -> None:
    project = web.sample()
    made = web.get(f"/api/projects/{project}/objects")[0]
    base, point = f"/api/projects/{project}/objects/{made['id']}", made["points"][0]["id"]
    moved = web.patch(f"{base}/points/{point}", {"x": 10.25, "label": 0})["points"][0]
    assert (moved["x"], moved["y"], moved["label"]) == (10.25, 60.5, 0)
    assert web.delete(f"{base}/points/{point}")["points"] == []
    web.delete(f"{base}/points/{point}", 404)


@pytest.mark.both_databases(quick=False)
def test_a_click_outside_the_recording_is_refused_in_one_line(web: Running) -> None:
    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    for wrong, words in (({"x": 160.0}, "outside"), ({"y": -0.5}, "outside"), ({"frame": 1}, "no frame 1")):
        error = web.post(f"/api/projects/{project}/objects/{number}/points", {**CLICK, **wrong}, 422)
        assert error["kind"] == "prompt"
        assert words in error["message"]
    assert len(web.get(f"/api/projects/{project}/objects")[0]["points"]) == 1


@pytest.mark.both_databases(quick=False)
def test_object_names_are_unique_and_valid_in_simulators(web: Running) -> None:
    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    assert "mug_1" in web.patch(f"/api/projects/{project}/objects/{number}", {"name": "mug_1"}, 422)["message"]
    assert web.patch(f"/api/projects/{project}/objects/{number}", {"name": "a b"}, 422)["kind"] == "prompt"
    web.post(f"/api/projects/{project}/objects", {"name": "MUG_1"}, 422)
    assert "item_1st_drawer" in web.patch(f"/api/projects/{project}/objects/{number}", {"name": "1st_drawer"}, 422)["hint"]
    assert "item_Aux" in web.patch(f"/api/projects/{project}/objects/{number}", {"name": "Aux"}, 422)["hint"]
    long = web.patch(f"/api/projects/{project}/objects/{number}", {"name": "x" * 300}, 422)["message"]
    assert long == "name: 300 characters, at most 60 expected"
    made = web.post(f"/api/projects/{project}/objects", {"category": "2-door cabinet"})
    assert made["name"] == "item_2_door_cabinet_1"  # the category stays as typed
    assert made["category"] == "2-door cabinet"


def test_changing_an_outdated_version_returns_the_stored_object(web: Running) -> None:
    project = web.sample()
    seen = web.get(f"/api/projects/{project}/objects")[0]
    address = f"/api/projects/{project}/objects/{seen['id']}"
    web.patch(address, {"category": "oven", "version": seen["version"]})
    error = web.patch(address, {"category": "hood", "version": seen["version"]}, 409)
    assert (error["kind"], error["current"]["category"]) == ("conflict", "oven")


@pytest.mark.both_databases(quick=False)
def test_a_custom_category_is_kept_with_a_notice(web: Running) -> None:
    project = web.sample()
    made = web.post(f"/api/projects/{project}/objects", {"category": "  tea   towel "}, 201)
    assert (made["name"], made["category"]) == ("tea_towel_1", "tea towel")
    assert any("tea towel" in notice for notice in made["notices"])


@pytest.mark.both_databases(quick=False)
def test_common_category_names_are_offered_with_label_and_joint(web: Running) -> None:
    offered = {entry["name"]: (entry["label"], entry["joint"]) for entry in web.get("/api/system")["categories"]}
    for name in ("drawer", "bottle", "mug", "chair"):
        assert offered[name][0] == name
    assert offered["sink"] == ("sink cabinet", "revolute")
    assert offered["chest_of_drawers"] == ("drawer stack", "prismatic")
    assert offered["sliding_wardrobe_door"] == ("sliding door", "prismatic")
    project = web.sample()
    for name in ("bottle", "sink", "Chest of Drawers"):
        assert web.post(f"/api/projects/{project}/objects", {"category": name}, 201)["notices"] == []


@pytest.mark.both_databases(quick=False)
def test_the_prompts_file_is_exported_and_imported(web: Running) -> None:
    project = web.sample()
    file = web.get(f"/api/projects/{project}/prompts.json")
    assert file["objects"][0] == {"name": "drawer_1", "category": "drawer", "points": [CLICK]}
    file["objects"][0]["points"].append({**CLICK, "x": 1.5})
    file["objects"].append({"name": "new_1", "category": "oven", "points": [CLICK]})
    assert len(web.post(f"/api/projects/{project}/prompts.json", file)) == 3
    objects = {o["name"]: o for o in web.get(f"/api/projects/{project}/objects")}
    assert (len(objects["drawer_1"]["points"]), len(objects)) == (2, 3)
    twice = {"version": 1, "objects": [file["objects"][0], file["objects"][0]]}
    assert web.post(f"/api/projects/{project}/prompts.json", twice, 422)["kind"] == "invalid"


def test_the_history_names_the_person_and_marks_undone_changes(web: Running) -> None:
    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    web.post(f"/api/projects/{project}/objects/{number}/points", CLICK, 201)
    web.post(f"/api/projects/{project}/undo", {"object": number})
    undo, click, *_ = web.get(f"/api/projects/{project}/history?object={number}")
    assert (undo["action"], click["action"], click["who"], click["undone"]) == ("undo", "add point", "tester", True)


def test_concurrent_clicks_are_all_stored(web: Running) -> None:
    from concurrent.futures import ThreadPoolExecutor

    project = web.sample()
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    address = f"/api/projects/{project}/objects/{number}/points?infer=false"
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda x: web.post(address, {**CLICK, "x": float(x)}, 201), range(12)))
    kept = web.get(f"/api/projects/{project}/objects")[0]
    assert sorted(p["x"] for p in kept["points"]) == [*range(12), 80.5]
    assert kept["version"] == 2 + 12


def test_frame_corrections_are_stored_exported_undone_and_removed(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    item = web.get(f"{at}/objects")[0]
    here, mask = f"{at}/objects/{item['id']}/frames", {"width": 4, "height": 3, "runs": [1, 2, 9]}

    def put(frame: int, said: Any, status: int = 200) -> Any:
        answer = web.client.put(f"{here}/{frame}", json={"mask": said})
        assert answer.status_code == status, answer.text
        return answer.json()

    before = web.get(f"{at}/prompts.json")
    assert before["version"] == 1
    put(3, None)
    put(7, mask)
    assert put(0, mask)["frames"] == [{"frame": number, "visible": number != 3} for number in (0, 3, 7)]
    file = web.get(f"{at}/prompts.json")
    assert file["version"] == 2
    assert file["objects"][0]["frames"][1:] == [{"frame": 3, "mask": None}, {"frame": 7, "mask": mask}]
    assert web.post(f"{at}/undo", {"object": item["id"]})["object"]["frames"] == [
        {"frame": 3, "visible": False},
        {"frame": 7, "visible": True},
    ]
    assert web.delete(f"{here}/7")["frames"] == [{"frame": 3, "visible": False}]
    assert len(web.post(f"{at}/undo", {"object": item["id"]})["object"]["frames"]) == 2
    put(999, None, 422)
    put(3, {**mask, "runs": [1]}, 422)


@pytest.mark.both_databases(quick=False)
def test_a_mask_with_another_aspect_ratio_than_its_frame_is_refused(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    item = web.get(f"{at}/objects")[0]
    wide = {"width": 16, "height": 9, "runs": [144]}  # on a frame of 160 x 120
    answer = web.client.put(f"{at}/objects/{item['id']}/frames/3", json={"mask": wide})
    assert answer.status_code == 422
    assert "frame 3: a mask of 16 x 9 found, 160 x 120 or smaller" in answer.json()["message"]
    entry = {"name": "mug_9", "category": "mug", "points": [CLICK], "frames": [{"frame": 3, "mask": wide}]}
    web.post(f"{at}/prompts.json", {"version": 2, "objects": [entry]}, 422)


@pytest.mark.both_databases(quick=False)
def test_corrections_of_missing_frames_are_refused_and_can_be_deleted(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    entry = {"name": "mug_9", "category": "mug", "points": [CLICK], "frames": [{"frame": 999, "mask": None}]}
    web.post(f"{at}/prompts.json", {"version": 2, "objects": [entry]}, 422)
    item = web.get(f"{at}/objects")[0]
    with writing(web.context.engine) as session:  # as an import by an older version stored it
        queries.object_row(session, project, item["id"]).frames = {"999": None}
    assert web.delete(f"{at}/objects/{item['id']}/frames/999")["frames"] == []
