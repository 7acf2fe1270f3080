import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.serve import register_finished
from r2c2r_core.generate.candidates import select_candidate
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.inputs import ObjectOverride
from r2c2r_core.model.scene import Box
from r2c2r_core.workspace import Workspace
from tests.app.conftest import Running
from tests.app.finished import copy_finished
from tests.app.nouns import finish, scene
from tests.app.test_jobs import run


@pytest.fixture
def reviewed(start: Callable[..., Any], tmp_path: Path) -> Iterator[tuple[Running, str, int]]:
    """A project whose drawer_1 is finished: the app, the project, the object."""
    project = copy_finished(tmp_path / "data")
    with start() as web:
        (drawer,) = [o for o in web.get(f"/api/projects/{project}/objects") if o["name"] == "drawer_1"]
        yield web, project, drawer["id"]


Reviewed = tuple[Running, str, int]


def overrides(web: Running, project: str) -> Any:
    job = web.get(f"/api/jobs?project={project}")[0]["id"]
    path = web.settings.data_dir / "projects" / project / "requests" / str(job) / "overrides.json"
    return json.loads(path.read_text())["objects"].get("drawer_1", {})


def test_candidates_are_returned_with_metrics_choice_and_reason(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    (group,) = web.get(f"/api/projects/{project}/candidates")
    assert (group["object"], group["chosen"], group["chosen_by"], group["reason"]) == (
        number,
        "c0",
        "consensus",
        "closest to the others",
    )
    assert [c["id"] for c in group["candidates"]] == ["c0", "c1"]
    metrics = group["candidates"][0]["metrics"]
    assert metrics["volume"] == 1.0
    assert "odd" not in metrics  # non-numeric values are left out
    assert group["candidates"][0]["assumes"] == "0.58 m deep, to the wall behind it"
    assert (group["placement"]["candidate"], group["placement"]["rms_m"], group["placement"]["votes"]) == (
        "c0",
        0.004,
        {"3": 12, "7": 18},
    )
    assert group["placement"]["spread"] == {"turn_deg": 0.2, "shift_m": 0.002, "scale": 0.004}
    assert group["placement"]["runner_up_turn_deg"] == 180.0
    web.get(f"/api/projects/{project}/objects/{number + 1}/candidates", 409)


def test_the_mesh_and_thumbnail_of_a_candidate_are_served_as_immutable(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    (first, second) = web.get(f"/api/projects/{project}/objects/{number}/candidates")["candidates"]
    mesh = web.client.get(first["glb"])
    assert mesh.content.startswith(b"glTF")
    assert "immutable" in mesh.headers["cache-control"]
    assert web.client.get(second["thumbnail"]).content.startswith(b"\x89PNG")
    assert web.client.get(f"/media/{project}/candidates/{number}/c9.glb").status_code == 404


def test_results_older_than_a_correction_are_marked_until_the_next_run(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    base = f"/api/projects/{project}"

    def changed() -> tuple[bool, bool]:
        return web.get(f"{base}/candidates")[0]["changed"], web.get(f"{base}/scene")["items"][0]["changed"]

    assert changed() == (False, False)
    web.patch(f"{base}/objects/{number}/override", {"hinge": "left", "rerun": False})
    assert changed() == (True, True)
    web.post(f"{base}/undo", {"object": number, "scope": "review"})
    assert changed() == (False, False)
    web.patch(f"{base}/objects/{number}/override", {"hinge": "left", "rerun": False})
    web.job(run(web, project), "done")
    assert changed() == (False, False)


def test_accepting_the_chosen_candidate_needs_no_run(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    said = web.post(
        f"/api/projects/{project}/objects/{number}/verdicts", {"candidate": "c0", "verdict": "accepted", "reason": "fits"}
    )
    assert (said["job"], said["group"]["accepted"]) == (None, "c0")
    assert said["group"]["candidates"][0]["verdict_by"] == "tester"
    assert web.get(f"/api/projects/{project}")["counts"]["accepted"] == 1


def test_accepting_another_candidate_overrides_the_choice_and_runs(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    said = web.post(f"/api/projects/{project}/objects/{number}/verdicts", {"candidate": "c1", "verdict": "accepted"})
    assert (said["group"]["chosen"], said["group"]["chosen_by"]) == ("c1", "person")
    web.job(said["job"]["id"], "done")
    assert overrides(web, project) == {"candidate": "c1"}


def test_rejecting_a_candidate_records_the_reason_and_runs(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    body = {"candidate": "c0", "verdict": "rejected", "reason": "the handle is missing"}
    said = web.post(f"/api/projects/{project}/objects/{number}/verdicts", body)
    assert said["group"]["candidates"][0]["verdict_reason"] == "the handle is missing"
    web.job(said["job"]["id"], "done")
    assert overrides(web, project) == {"rejected": ["c0"]}


def test_the_candidate_shown_as_chosen_is_the_one_a_run_uses(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    address = f"/api/projects/{project}/objects/{number}"
    work = Workspace(web.settings.data_dir / "projects" / project / "work")

    def shown_and_taken() -> tuple[str, str]:
        said = web.get(f"{address}/override")
        corrected = ObjectOverride(candidate=said["candidate"], rejected=tuple(said["rejected"]))
        taken = select_candidate(work.load_latest("generate", "drawer_1"), corrected, "medoid")
        return web.get(f"{address}/candidates")["chosen"], taken.chosen_id

    assert shown_and_taken() == ("c0", "c0")
    said = web.post(f"{address}/verdicts", {"candidate": "c0", "verdict": "rejected", "rerun": False})
    assert said["group"]["chosen"] == "c1"  # immediately, before any run
    assert shown_and_taken() == ("c1", "c1")
    web.post(f"{address}/verdicts", {"candidate": "c0", "verdict": "accepted", "rerun": False})
    assert shown_and_taken() == ("c0", "c0")
    web.post(f"/api/projects/{project}/undo", {"object": number, "scope": "review"})
    assert shown_and_taken() == ("c1", "c1")
    web.post(f"{address}/verdicts", {"candidate": "c1", "verdict": "rejected", "rerun": False})
    group = web.get(f"{address}/candidates")
    assert group["chosen"] == ""  # none is used until new candidates are made
    assert "every candidate was rejected" in group["reason"]


def test_rejecting_every_candidate_or_a_request_generates_more(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    address = f"/api/projects/{project}/objects/{number}"
    known = [candidate["id"] for candidate in web.get(f"{address}/candidates")["candidates"]]
    for candidate in known:
        assert web.get(f"{address}/override")["regenerate"] == 0
        web.post(f"{address}/verdicts", {"candidate": candidate, "verdict": "rejected", "rerun": False})
    assert web.get(f"{address}/override")["regenerate"] == 1
    said = web.patch(f"{address}/override", {"regenerate": 2})
    web.job(said["job"]["id"], "done")
    assert overrides(web, project) == {"rejected": known, "regenerate": 2}
    web.patch(f"{address}/override", {"regenerate": 21}, 422)


def test_verdicts_are_undone_and_redone_independently_of_clicks(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    address = f"/api/projects/{project}/objects/{number}"
    web.post(f"{address}/verdicts", {"candidate": "c0", "verdict": "rejected", "rerun": False})
    web.post(f"{address}/verdicts", {"candidate": "c1", "verdict": "accepted", "rerun": False})
    web.post(f"/api/projects/{project}/undo", {"object": number, "scope": "review"})
    group = web.get(f"{address}/candidates")
    assert (group["accepted"], group["override"]["rejected"], group["override"]["candidate"]) == (None, ["c0"], None)
    assert group["can_redo"]
    web.post(f"/api/projects/{project}/undo", {"object": number, "scope": "review"})
    assert web.get(f"{address}/override")["rejected"] == []
    web.post(f"/api/projects/{project}/redo", {"object": number, "scope": "review"})
    assert web.get(f"{address}/candidates")["candidates"][0]["verdict"] == "rejected"
    assert web.get(f"/api/projects/{project}/objects")[0]["points"]  # the clicks are kept


def test_a_verdict_can_be_cleared(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    address = f"/api/projects/{project}/objects/{number}"
    web.post(f"{address}/verdicts", {"candidate": "c0", "verdict": "rejected", "rerun": False})
    web.post(f"{address}/verdicts", {"candidate": "c0", "verdict": "cleared", "rerun": False})
    group = web.get(f"{address}/candidates")
    assert (group["candidates"][0]["verdict"], group["override"]["rejected"]) == (None, [])
    web.post(f"{address}/verdicts", {"candidate": "c7", "verdict": "rejected"}, 404)


def test_corrections_are_validated_stored_and_cleared(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    address = f"/api/projects/{project}/objects/{number}/override"
    web.patch(address, {"hinge": "left", "dimensions_m": [0.5, 0.6, 0.2], "rerun": False})
    web.patch(address, {"dimensions_m": None, "rerun": False})
    assert (web.get(address)["hinge"], web.get(address)["dimensions_m"]) == ("left", None)
    for wrong in (
        {"joint_lower": 1.0, "joint_upper": 1.5},
        {"candidate": "c9"},
        {"candidate": "/etc/passwd"},
        {"candidate": "pyproject.toml"},
    ):
        assert web.patch(address, wrong, 422)["kind"] == "override", wrong
    for wrong in (
        {"dimensions_m": [0.5, -0.6, 0.2]},
        {"dimensions_m": [1e9, 1e9, 1e9]},
        {"joint_upper": 1e9},
        {"joints": {"left_door": [2.0, 1.0]}},
        {"pose": [[1.0, 0.0], [0.0, 1.0]]},
        {"pose": [[1.0, 0.0, 0.0, 1e12], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]},
        {"regenerate": 10**9},
    ):
        assert web.patch(address, wrong, 422)["kind"] == "invalid", wrong
    web.patch(address, {"joint_lower": 0.0, "joints": {"left_door": [None, 1.2]}, "rerun": False})
    assert (web.get(address)["joint_lower"], web.get(address)["joints"]) == (0.0, {"left_door": [None, 1.2]})
    outside = f"{web.settings.data_dir}/projects/{project}/uploads/../frames.json"
    assert web.patch(address, {"candidate": outside}, 403)["kind"] == "forbidden"
    assert web.patch(address, {"hinge": "diagonal"}, 422)["kind"] == "invalid"


def test_frames_marked_closed_or_open_reach_the_run_and_are_undone(reviewed: Reviewed) -> None:
    """A run reads the marks from the same overrides.json as one without the app."""
    web, project, number = reviewed
    address = f"/api/projects/{project}/objects/{number}"
    marks = {"left": [{"frame": 3, "state": 0.0}, {"frame": 20, "state": 1.2}]}
    said = web.patch(f"{address}/override", {"states": marks})
    assert said["text"].endswith("openings marked in 2 frames")
    web.job(said["job"]["id"], "done")
    assert overrides(web, project) == {"states": marks}
    for wrong in ({"left": [{"frame": -1, "state": 0.0}]}, {"left": [{"frame": 0, "state": 90.0}]}):
        assert web.patch(f"{address}/override", {"states": wrong}, 422)["kind"] == "invalid", wrong
    web.post(f"/api/projects/{project}/undo", {"object": number, "scope": "review"})
    assert web.get(f"{address}/override")["states"] == {}


def test_the_scene_endpoint_lists_objects_joints_and_stages(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    scene = web.get(f"/api/projects/{project}/scene")
    (item,) = scene["items"]
    assert (item["object"], item["dimensions_m"], item["mask_frames"], item["placement_rms_m"]) == (
        number,
        [0.5, 0.6, 0.2],
        2,
        0.004,
    )
    (joint,) = item["joints"]
    assert (joint["name"], joint["upper"], joint["sources"]["limits"]) == ("drawer_1_slide", 0.4, "default")
    assert scene["stages"] == [{"name": "segment", "backend": "fake", "seconds": None}]
    assert web.client.get(scene["glb"]).status_code == 200


def test_masks_of_the_last_run_are_shown_until_the_clicks_change(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    (lane,) = [lane for lane in web.get(f"/api/projects/{project}/lanes") if lane["object"] == number]
    assert (lane["frames"], lane["source"]) == ([3, 7], "run")
    (shown,) = web.get(f"/api/projects/{project}/masks/7")
    assert (shown["confidence"], shown["mask"]["box_width"]) == (0.4, 40)
    click = {"frame": 3, "x": 1.0, "y": 1.0, "label": 0}
    web.post(f"/api/projects/{project}/objects/{number}/points?infer=false", click, 201)
    assert web.get(f"/api/projects/{project}/masks/7") == []


def test_registering_a_finished_workspace_twice_creates_one_project(start: Callable[..., Any], tmp_path: Path) -> None:
    work = tmp_path / "demo" / "work"
    work.mkdir(parents=True)
    finish(work)
    (work / "bundle.zip").write_bytes(b"PK")
    prompts = tmp_path / "prompts.json"
    points = [{"frame": 3, "x": 80.0, "y": 60.0, "label": 1}]
    prompts.write_text(json.dumps({"version": 1, "objects": [{"name": "drawer_1", "category": "drawer", "points": points}]}))
    given = {"name": "Sample kitchen", "source": tmp_path / "scan.r3d", "prompts": prompts, "workdir": work}
    (tmp_path / "data").mkdir()
    project = register_finished(tmp_path / "data", **given)
    assert register_finished(tmp_path / "data", **given) == project
    with start() as web:
        (found,) = web.get("/api/projects")
        assert (found["id"], found["status"], found["counts"]["objects"], found["result"]) == (project, "ready", 1, "current")
        assert found["size_bytes"] > 0
        assert web.get(f"/api/projects/{project}/objects")[0]["segment"] == "done"
        assert web.client.get(f"/media/{project}/frames/3.jpg").status_code == 200
        web.delete(f"/api/projects/{project}")
        web.delete(f"/api/trash/{project}")
    assert work.exists()  # outside the data folder: not ours to delete


def test_only_changes_that_affect_the_result_make_it_stale(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    address = f"/api/projects/{project}/objects/{number}"
    web.post(f"{address}/verdicts", {"candidate": "c0", "verdict": "accepted"})
    web.patch(f"/api/projects/{project}", {"name": "another name"})
    web.patch(address, {"colour": 5})
    assert web.get(f"/api/projects/{project}")["result"] == "current"
    web.patch(f"{address}/override", {"hinge": "left", "rerun": False})
    assert web.get(f"/api/projects/{project}")["result"] == "stale"
    web.post(f"/api/projects/{project}/undo", {"object": number, "scope": "review"})
    assert web.get(f"/api/projects/{project}")["result"] == "current"


def test_a_review_of_an_outdated_version_is_refused_with_both_states(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    at = f"/api/projects/{project}/objects/{number}"
    seen = web.get(f"{at}/candidates")["version"]
    said = web.patch(f"{at}/override", {"hinge": "left", "rerun": False, "version": seen})
    assert said["group"]["version"] > seen
    mine = {"hinge": "right", "rerun": False, "version": seen}
    refused = web.patch(f"{at}/override", mine, 409)
    assert (refused["kind"], "tester" in refused["message"]) == ("conflict", True)
    assert (refused["current"]["override"]["hinge"], refused["current"]["yours"]) == ("left", {"hinge": "right"})
    verdict = {"candidate": "c1", "verdict": "accepted", "rerun": False}
    stale = web.post(f"{at}/verdicts", {**verdict, "version": seen}, 409)["current"]
    assert stale["group"]["accepted"] is None
    assert web.post(f"{at}/verdicts", {**verdict, "version": stale["version"]})["group"]["accepted"] == "c1"
    again = web.patch(f"{at}/override", {**mine, "version": web.get(f"{at}/candidates")["version"]})
    assert again["group"]["override"]["hinge"] == "right"


@pytest.mark.parametrize("direction", ["undo", "redo"])
def test_undo_and_redo_of_an_outdated_review_are_conflicts(reviewed: Reviewed, direction: str) -> None:
    web, project, number = reviewed
    base, at = f"/api/projects/{project}", f"/api/projects/{project}/objects/{number}"
    mine = {"object": number, "scope": "review"}
    seen = web.patch(f"{at}/override", {"hinge": "left", "rerun": False})["group"]["version"]
    if direction == "redo":
        seen = web.post(f"{base}/undo", {**mine, "version": seen})["version"]
        web.post(f"{base}/redo", mine)  # by somebody who loaded it before
    else:
        web.patch(f"{at}/override", {"hinge": "right", "rerun": False})
    stored = web.get(f"{at}/candidates")
    refused = web.post(f"{base}/{direction}", {**mine, "version": seen}, 409)
    assert (refused["kind"], refused["current"]["group"]) == ("conflict", stored)
    assert web.get(f"{at}/candidates") == stored
    undone = web.post(f"{base}/undo", {**mine, "version": refused["current"]["version"]})
    assert undone["version"] == web.get(f"{at}/candidates")["version"] > stored["version"]


def test_changing_a_category_does_not_change_the_review_version(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    at = f"/api/projects/{project}/objects/{number}"
    seen = web.get(f"{at}/candidates")["version"]
    web.patch(at, {"category": "oven"})
    web.patch(f"{at}/override", {"hinge": "left", "rerun": False, "version": seen})


@pytest.mark.parametrize("what", ["dimensions_m", "pose"])
def test_a_correction_with_nan_is_refused(reviewed: Reviewed, what: str) -> None:
    web, project, number = reviewed
    at = f"/api/projects/{project}/objects/{number}/override"
    value = {"dimensions_m": [1, 1, "nan"], "pose": [[1, 0, 0, "nan"], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}[what]
    body = json.dumps({what: value, "rerun": False}).replace('"nan"', "NaN")
    refused = web.client.patch(at, content=body, headers={"content-type": "application/json"})
    assert (refused.status_code, web.get(at)[what]) == (422, None)


def test_a_rename_keeps_masks_candidates_verdicts_and_scene_objects(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    at, address = f"/api/projects/{project}", f"/api/projects/{project}/objects/{number}"
    web.post(f"{address}/verdicts", {"candidate": "c0", "verdict": "accepted"})

    def seen() -> Any:
        (lane,) = [lane for lane in web.get(f"{at}/lanes") if lane["object"] == number]
        (group,) = web.get(f"{at}/candidates")
        (item,) = web.get(f"{at}/scene")["items"]
        photos = web.get(f"{address}/photos")
        return lane["frames"], group["chosen"], group["accepted"], item["object"], item["mask_frames"], len(photos["photos"])

    before = seen()
    assert (before[0], before[2], before[3]) == ([3, 7], "c0", number)
    web.patch(address, {"name": "cutlery"})
    assert seen() == before
    assert [item["name"] for item in web.get(f"{at}/scene")["items"]] == ["cutlery"]
    assert [(group["name"], group["run_name"]) for group in web.get(f"{at}/candidates")] == [("cutlery", "drawer_1")]
    (other,) = [item for item in web.get(f"{at}/objects") if item["id"] != number]
    web.patch(f"{at}/objects/{other['id']}", {"name": "drawer_1"})  # a free name; results under it are another's
    assert seen() == before
    web.post(f"{at}/undo", {"object": other["id"]})
    web.post(f"{at}/undo", {"object": number})
    assert seen() == before
    web.patch(address, {"name": "cutlery"})
    web.job(run(web, project), "done")
    finish(web.settings.data_dir / "projects" / project / "work", "cutlery")
    assert [(group["name"], group["run_name"]) for group in web.get(f"{at}/candidates")] == [("cutlery", "cutlery")]


def test_the_scene_tells_where_a_handle_was_seen_but_not_one_made_up(reviewed: Reviewed) -> None:
    web, project, _ = reviewed
    made = scene("drawer_1")
    (drawer,) = made.objects
    base, front = drawer.links
    work = Workspace(web.settings.data_dir / "projects" / project / "work")
    for source, told in (("measured", [0.2, -0.3, 0.05]), ("default", None)):
        place = Rigid3(np.eye(3), np.array([0.2, 0.0, 0.05]))
        knob = Box(name="knob", role="handle", size_m=np.full(3, 0.02), link_from_box=place, sources={"place": source})
        leaf = replace(front, boxes=(knob,), object_from_link=Rigid3(np.eye(3), np.array([0.0, -0.3, 0.0])))
        work.save(
            "warp", "scene", replace(made, objects=(replace(drawer, links=(base, leaf)),)), {"key": source, "seconds": 1.0}
        )
        assert web.get(f"/api/projects/{project}/scene")["items"][0]["joints"][0]["handle"] == told


def test_objects_without_clicks_are_corrected_and_left_out_by_name(reviewed: Reviewed) -> None:
    web, project, _ = reviewed
    made = scene("drawer_1")
    (drawer,) = made.objects
    work = web.settings.data_dir / "projects" / project / "work"
    objects = (drawer, replace(drawer, name="counter_1", category="counter", joints=(), links=drawer.links[:1]))
    Workspace(work).save("warp", "scene", replace(made, objects=objects), {"key": "k2", "seconds": 1.0})
    found = {item["run_name"]: item for item in web.get(f"/api/projects/{project}/scene")["items"]}
    assert found["counter_1"]["object"] is None
    url = f"/api/projects/{project}/scene/counter_1/override"
    sized = web.patch(url, {"dimensions_m": [3.0, 0.6, 0.04], "colour": [0.1, 0.2, 0.3], "rerun": False})
    assert sized["text"].startswith("counter_1: size 300.0")
    web.patch(url, {"left_out": True, "rerun": False})
    told = web.get(f"/api/projects/{project}/scene")
    assert [item["name"] for item in told["left_out"]] == ["counter_1"]
    assert web.patch(url, {"left_out": None, "rerun": False})["text"] == "counter_1: brought back"
    assert web.get(f"/api/projects/{project}/scene")["left_out"] == []
    (counter,) = [o for o in web.get(f"/api/projects/{project}/objects") if o["name"] == "counter_1"]
    assert web.get(f"/api/projects/{project}/objects/{counter['id']}/override")["dimensions_m"] == [3.0, 0.6, 0.04]
    assert web.get(f"/api/projects/{project}/scene")["unused"] == []
    Workspace(work).save("warp", "scene", made, {"key": "k3", "seconds": 1.0})  # a run that found no counter
    told = web.get(f"/api/projects/{project}/scene")
    assert [(item["object"], item["name"]) for item in told["unused"]] == [(counter["id"], "counter_1")]
    web.patch(f"/api/projects/{project}/objects/{counter['id']}/override", {"left_out": True, "rerun": False})
    assert web.get(f"/api/projects/{project}/scene")["unused"] == []  # as requested
    web.patch(f"/api/projects/{project}/scene/absent/override", {"left_out": True}, 404)
    web.patch(f"/api/projects/{project}/objects/{counter['id']}/override", {"built_as": "frobnicator", "rerun": False}, 422)


def clicked(web: Running, project: str) -> dict[str, int]:
    """Number of clicks of each object of the newest run, by its name there."""
    job = web.get(f"/api/jobs?project={project}")[0]["id"]
    path = web.settings.data_dir / "projects" / project / "requests" / str(job) / "prompts.json"
    return {entry["name"]: len(entry["points"]) for entry in json.loads(path.read_text())["objects"]}


def test_a_correction_run_ignores_clicks_made_since_the_last_run(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    first, second = (item["id"] for item in web.get(f"/api/projects/{project}/objects")[:2])
    names = {item["id"]: item["name"] for item in web.get(f"/api/projects/{project}/objects")}
    before = clicked(web, project)
    click = {"frame": 0, "x": 40.5, "y": 40.5, "label": 1}
    web.post(f"/api/projects/{project}/objects/{second}/points", click, status=201)
    web.patch(f"/api/projects/{project}/objects/{second}", {"name": "renamed"})
    web.post(f"/api/projects/{project}/objects", {"name": "half_done", "category": "drawer"}, status=201)
    third = web.get(f"/api/projects/{project}/objects")[-1]["id"]
    web.post(f"/api/projects/{project}/objects/{third}/points", click, status=201)

    said = web.patch(f"/api/projects/{project}/objects/{first}/override", {"joint_upper": 0.3})
    web.job(said["job"]["id"], "done")
    assert clicked(web, project) == {names[first]: before[names[first]], "renamed": before[names[second]]}
    assert web.get(f"/api/projects/{project}")["result"] == "stale"  # clicks by others are missing in it

    web.job(run(web, project), "done")
    assert clicked(web, project)["half_done"] == 1
    assert clicked(web, project)["renamed"] == before[names[second]] + 1
    assert web.get(f"/api/projects/{project}")["result"] == "current"


def test_a_correction_run_without_new_clicks_gives_a_current_result(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    first = web.get(f"/api/projects/{project}/objects")[0]["id"]
    said = web.patch(f"/api/projects/{project}/objects/{first}/override", {"joint_upper": 0.3})
    web.job(said["job"]["id"], "done")
    assert web.get(f"/api/projects/{project}")["result"] == "current"
