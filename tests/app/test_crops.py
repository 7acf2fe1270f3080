"""Crop box of an object: stored, undone, written to prompts.json and read back; and the data it is drawn with."""

from typing import Any

import pytest

from tests.app.conftest import Running
from tests.app.test_live import listening, until
from tests.app.test_reviews import Reviewed, reviewed

__all__ = ["reviewed"]

CROP: dict[str, Any] = {"corner_m": [0.1, 0.2, 0.3], "edges_m": [[0.4, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.6]]}
MUG = {"category": "mug", "points": [{"frame": 3, "x": 152, "y": 40}]}


def test_setting_a_crop_box_recomputes_the_masks_and_can_be_undone(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    made = web.post(f"{at}/objects", MUG, 201)
    here = f"{at}/objects/{made['id']}"
    assert made["crop"] is None

    def state() -> str:
        (item,) = [one for one in web.get(f"{at}/objects") if one["id"] == made["id"]]
        return str(item["segment"])

    web.until(lambda: state() == "done")
    with listening(web, project) as socket:
        assert web.patch(here, {"crop": CROP})["crop"] == CROP
        until(socket, type="segment", object=made["id"], restart=True)
        until(socket, type="segment", object=made["id"], state="done")
    assert web.patch(here, {"name": "renamed"})["crop"] == CROP  # a missing field is not null
    assert web.patch(here, {"crop": None})["crop"] is None
    assert web.post(f"{at}/undo", {"object": made["id"]})["object"]["crop"] == CROP


def test_prompts_json_version_3_stores_the_crop_box_and_is_read_back(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    made = web.post(f"{at}/objects", {**MUG, "name": "cup"}, 201)
    assert web.get(f"{at}/prompts.json")["version"] == 1
    web.patch(f"{at}/objects/{made['id']}", {"crop": CROP})
    file = web.get(f"{at}/prompts.json")
    assert file["version"] == 3
    (entry,) = [entry for entry in file["objects"] if entry["name"] == "cup"]
    assert entry["crop"] == CROP
    other = web.sample()
    web.post(f"/api/projects/{other}/prompts.json", file)
    (taken,) = [one for one in web.get(f"/api/projects/{other}/objects") if one["name"] == "cup"]
    assert taken["crop"] == CROP


@pytest.mark.parametrize("edges", [CROP["edges_m"][:2], [[1, 0, 0], [1, 1, 0], [0, 0, 1]], [[0, 0, 0]] * 3])
def test_an_invalid_crop_box_is_refused_and_not_stored(web: Running, edges: Any) -> None:
    project = web.sample()
    made = web.post(f"/api/projects/{project}/objects", MUG, 201)
    web.patch(f"/api/projects/{project}/objects/{made['id']}", {"crop": {**CROP, "edges_m": edges}}, 422)
    (item,) = [one for one in web.get(f"/api/projects/{project}/objects") if one["id"] == made["id"]]
    assert item["crop"] is None


def test_the_suggested_crop_box_contains_the_centre_and_frames_have_cameras(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    found = web.get(f"/api/projects/{project}/objects/{number}/cloud")
    around = found["around"]
    for axis in range(3):
        assert around["corner_m"][axis] < found["centre_m"][axis] < around["corner_m"][axis] + around["edges_m"][axis][axis]
    camera = web.get(f"/api/projects/{project}/frames/3/camera")
    assert (camera["width"], camera["fx"]) == (160, 150)
    assert camera["camera_from_capture"][3] == [0, 0, 0, 1]
    web.get(f"/api/projects/{project}/frames/999/camera", 404)
