import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.db import queries
from app.db.engine import reading, writing
from app.files import ProjectFiles
from app.jobs.front_wire import front_line
from app.jobs.mask_store import mask_path
from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.workspace import Workspace
from tests.app.conftest import Running
from tests.app.nouns import track

CORNERS = [[0.0, 2.0, 0.8], [0.6, 2.0, 0.8], [0.6, 2.0, 0.1], [0.0, 2.0, 0.1]]
FRONT: dict[str, Any] = {"corners_m": CORNERS, "handle": "none", "hinge": "left"}
DRAWN = {"category": "cabinet", "front": FRONT}


def drawn(web: Running, project: str) -> dict[str, Any]:
    """Planes drawn by the live segmenter."""
    at = f"/api/projects/{project}"
    assert web.get(f"{at}/elevations") == {"drawn": False, "items": []}
    web.post(f"{at}/live/open")
    web.until(lambda: web.get(f"{at}/elevations")["drawn"])
    found: dict[str, Any] = web.get(f"{at}/elevations")
    return found


def test_preparing_a_scan_renders_its_elevation_planes(web: Running) -> None:
    project = web.sample()
    (plane,) = drawn(web, project)["items"]
    assert (plane["columns"], plane["rows"], plane["cell_m"]) == (240, 90, 0.01)
    assert plane["cells"] == [[0.0, 10.0, 60.0, 80.0]]
    picture = web.client.get(plane["url"])
    assert picture.headers["content-type"] == "image/png"
    web.get(f"/media/{project}/elevations/7.png", 404)


def test_a_drawn_front_is_an_object_with_masks_and_no_click(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    made = web.post(f"{at}/objects", DRAWN, 201)
    assert (made["name"], made["points"], made["segment"]) == ("cabinet_1", [], "waiting")
    assert made["front"]["corners_m"] == CORNERS
    web.until(lambda: any(front["object"] == made["id"] for front in web.get(f"{at}/elevations/fronts")))
    (found,) = [front for front in web.get(f"{at}/elevations/fronts") if front["object"] == made["id"]]
    assert found["corners_m"] == CORNERS


def test_a_drawn_front_is_changed_undone_and_redone(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    made = web.post(f"{at}/objects", DRAWN, 201)
    here = f"{at}/objects/{made['id']}"
    wider = {**FRONT, "corners_m": [[x + (0.1 if x else 0.0), y, z] for x, y, z in CORNERS]}
    moved = web.patch(here, {"front": wider, "version": made["version"]})
    assert moved["front"]["corners_m"][1][0] == 0.7
    stale = web.client.patch(here, json={"front": FRONT, "version": made["version"]})
    assert stale.status_code == 409
    assert stale.json()["current"]["front"]["corners_m"][1][0] == 0.7
    assert web.patch(here, {"front": None})["front"] is None
    assert web.post(f"{at}/undo", {"object": made["id"]})["object"]["front"]["corners_m"][1][0] == 0.7
    assert web.post(f"{at}/undo", {"object": made["id"]})["object"]["front"]["corners_m"][1][0] == 0.6
    assert web.post(f"{at}/redo", {"object": made["id"]})["object"]["front"]["corners_m"][1][0] == 0.7
    assert web.patch(here, {"name": "renamed"})["front"]["corners_m"][1][0] == 0.7  # a missing field is not null


def test_changing_a_hinge_does_not_recompute_the_masks(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    made = web.post(f"{at}/objects", DRAWN, 201)

    def state() -> str:
        (item,) = [one for one in web.get(f"{at}/objects") if one["id"] == made["id"]]
        return str(item["segment"])

    web.until(lambda: state() == "done")
    turned = web.patch(f"{at}/objects/{made['id']}", {"front": {**FRONT, "hinge": "right"}})
    assert turned["segment"] == "done"


def test_prompts_json_stores_drawn_fronts_and_is_read_back(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    assert web.get(f"{at}/prompts.json")["version"] == 1
    web.post(f"{at}/objects", {**DRAWN, "name": "door"}, 201)
    file = web.get(f"{at}/prompts.json")
    assert file["version"] == 2
    (entry,) = [entry for entry in file["objects"] if entry["name"] == "door"]
    assert entry == {"name": "door", "category": "cabinet", "points": [], "front": FRONT}
    other = web.sample()
    web.post(f"/api/projects/{other}/prompts.json", file)
    (taken,) = [one for one in web.get(f"/api/projects/{other}/objects") if one["name"] == "door"]
    assert taken["front"] == FRONT


@pytest.mark.parametrize("corners", [CORNERS[:3], [[0.0, 0.0, 0.0]] * 4, [[0, 0, 1], [1, 0, 2], [1, 0, 0], [0, 0, 0]]])
def test_a_front_that_is_not_a_rectangle_is_refused(web: Running, corners: Any) -> None:
    project = web.sample()
    web.post(f"/api/projects/{project}/objects", {"front": {"corners_m": corners}}, 422)


OUTSIDE = {"left_m": 0.29, "bottom_m": 0.0, "right_m": 0.31, "top_m": 0.1}


def test_a_handle_outside_its_front_is_refused_and_a_stored_one_is_dropped(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    made = web.post(f"{at}/objects", DRAWN, 201)
    here = f"{at}/objects/{made['id']}"
    web.patch(here, {"front": {**FRONT, "handle": {**OUTSIDE, "right_m": 0.3}}})
    answer = web.client.patch(here, json={"front": {**FRONT, "handle": OUTSIDE}})
    assert answer.status_code == 422
    assert "a handle outside its front of 0.600 by 0.700 m found" in answer.text
    with writing(web.context.engine) as session:
        queries.object_row(session, project, made["id"]).front = {**FRONT, "handle": OUTSIDE}
    assert web.get(f"{at}/objects")[-1]["front"]["handle"] is None
    assert web.get(f"{at}/prompts.json")["objects"][-1]["front"]["hinge"] == "left"


def clicked(web: Running) -> tuple[str, ProjectFiles, Path]:
    """A project whose first object's masks are done, and their path."""
    project = web.sample()
    at = f"/api/projects/{project}"
    number = web.get(f"{at}/objects")[0]["id"]
    web.post(f"{at}/objects/{number}/segment")
    web.until(lambda: web.get(f"{at}/objects")[0]["segment"] == "done")
    with reading(web.context.engine) as session:
        files = web.context.files(queries.project_row(session, project))
        key = queries.object_row(session, project, number).masks_key
    return at, files, mask_path(files.masks, number, key)


def without_front(path: Path) -> None:
    """Rewrite the file as an older version that did not store the front."""
    *lines, end = path.read_text().splitlines()
    older = {key: value for key, value in json.loads(end).items() if key != "front"}
    path.write_text("\n".join([*lines, json.dumps(older)]) + "\n")


def test_a_front_measured_by_the_last_run_is_shown_if_live_masks_have_none(web: Running) -> None:
    at, files, _ = clicked(web)
    assert web.get(f"{at}/elevations/fronts") == []
    front = FrontPanel(world_from_front=Rigid3(), width_m=0.6, height_m=0.7, handle=None, confidence=1.0)
    found = replace(track("drawer_1"), front=front)
    Workspace(files.work).save("segment", "drawer_1", found, {"key": "k", "seconds": 1.0})
    files.finished_prompts.write_text(json.dumps(web.get(f"{at}/prompts.json")))
    (shown,) = web.get(f"{at}/elevations/fronts")
    (kept,) = (files.previews / "masks").iterdir()
    without_front(kept)
    assert web.get(f"{at}/elevations/fronts") == [shown]


def test_opening_a_scan_recomputes_masks_stored_without_a_front(web: Running) -> None:
    at, _, path = clicked(web)
    without_front(path)
    assert web.get(f"{at}/objects")[0]["segment"] == "partial"
    web.post(f"{at}/live/open")
    web.until(lambda: web.get(f"{at}/objects")[0]["segment"] == "done")
    assert "front" in json.loads(path.read_text().splitlines()[-1])


def test_a_detected_front_is_sent_in_the_format_of_a_drawn_one() -> None:
    into_capture = Rigid3(np.eye(3), np.array([1.0, 0.0, 0.0]))
    at = Rigid3(front_rotation(np.array([0.0, -1.0, 0.0])), np.array([0.3, 2.0, 0.45]))
    panel = FrontPanel(world_from_front=at, width_m=0.6, height_m=0.7, handle=None, confidence=1.0)
    line = front_line(panel, "cabinet", into_capture.inverse)
    there = np.array(CORNERS) + np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(line["corners_m"], there, atol=1e-6)
    assert line["certainty"] == 1.0  # nothing was detected that could be wrong
    assert line["handle"] is None
