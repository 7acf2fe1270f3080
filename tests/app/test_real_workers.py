"""The real worker processes behind the queue, run once on a very small kitchen."""

from collections.abc import Callable
from typing import Any

import pytest

from app.jobs.plans import Commands


@pytest.mark.slow
def test_a_sample_is_generated_imported_and_segmented_by_real_workers(start: Callable[..., Any]) -> None:
    with start(commands=Commands()) as web:
        wish = {"seed": 1, "frames": 10, "width": 320, "height": 240}
        project = web.post("/api/projects/sample", wish, 202)["id"]
        web.until(lambda: web.get(f"/api/projects/{project}")["thumbnail"])  # a first frame, while others are still rendered
        (shown,) = [one["thumbnail"] for one in web.get("/api/projects")]
        assert "arriving" in shown
        assert web.client.get(shown).content[:2] == b"\xff\xd8"  # JPEG
        web.until(lambda: web.get(f"/api/projects/{project}")["status"] != "importing")
        found = web.get(f"/api/projects/{project}")
        assert found["status"] == "ready", found["error"]
        assert (found["capture"]["frame_count"], found["capture"]["width"], found["capture"]["up_source"]) == (10, 320, "file")
        assert found["counts"]["objects"] == found["counts"]["points"] > 5
        frame = web.get(f"/api/projects/{project}/frames")[4]["index"]
        assert web.client.get(f"/media/{project}/frames/{frame}.jpg?w=160").headers["content-type"] == "image/jpeg"
        objects = web.get(f"/api/projects/{project}/objects")
        base = next(item for item in objects if item["category"] in ("cabinet", "drawer"))
        web.post(f"/api/projects/{project}/objects/{base['id']}/segment", status=202)
        web.until(lambda: _segment(web, project, base["id"]) not in ("waiting", "running"))
        assert _segment(web, project, base["id"]) == "done"
        (lane,) = [lane for lane in web.get(f"/api/projects/{project}/lanes") if lane["object"] == base["id"]]
        assert base["points"][0]["frame"] in lane["frames"]


def _segment(web: Any, project: str, number: int) -> str:
    return next(str(o["segment"]) for o in web.get(f"/api/projects/{project}/objects") if o["id"] == number)
