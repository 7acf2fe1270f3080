"""Review states, enforced by the server, and comments pinned to a place."""

from dataclasses import replace
from typing import Any

import pytest
from sqlmodel import select

from app import schemas
from app.db import keys, queries
from app.db.engine import writing
from app.db.tables import Bundle
from app.services import jobs
from r2c2r_core.model.motion import Source
from r2c2r_core.workspace import Workspace
from tests.app.conftest import Running
from tests.app.nouns import scene
from tests.app.test_jobs import run
from tests.app.test_reviews import Reviewed, reviewed

__all__ = ["reviewed"]


def step(web: Running, project: str, to: str, reason: str = "", status: int = 200) -> Any:
    state = web.get(f"/api/projects/{project}/review")["state"]
    return web.post(f"/api/projects/{project}/review", {"from_state": state, "to": to, "reason": reason}, status)


def certified(web: Running, project: str, passed: bool) -> None:
    with writing(web.context.engine) as session:
        for bundle in session.exec(select(Bundle).where(Bundle.project_id == project)):
            bundle.certificate = {"passed": passed}
            session.add(bundle)


def test_a_new_project_is_a_draft_and_rejects_illegal_transitions(web: Running) -> None:
    project = web.sample()
    assert web.get(f"/api/projects/{project}")["review_state"] == "draft"
    refused = step(web, project, "approved", "because", 409)
    assert "cannot become approved" in refused["message"]
    assert web.get(f"/api/projects/{project}/review")["state"] == "draft"
    assert [move["to"] for move in web.get(f"/api/projects/{project}/review")["moves"]] == ["ready"]


def test_unmet_conditions_are_listed_and_overridden_by_a_reason(web: Running) -> None:
    project = web.sample()
    web.post(f"/api/projects/{project}/objects", {"name": "bare", "category": "mug"})
    (move,) = web.get(f"/api/projects/{project}/review")["moves"]
    assert any("bare" in line for line in move["unmet"])
    assert "bare" in step(web, project, "ready", status=409)["message"]
    said = step(web, project, "ready", "the mug is only a note")
    assert (said["state"], said["who"], said["reason"]) == ("ready", "tester", "the mug is only a note")


def test_a_transition_from_an_outdated_state_is_a_conflict(web: Running) -> None:
    project = web.sample()
    step(web, project, "ready", "go")
    stale = web.post(f"/api/projects/{project}/review", {"from_state": "draft", "to": "ready", "reason": "me too"}, 409)
    assert stale["current"]["state"] == "ready"


@pytest.fixture
def under_review(reviewed: Reviewed) -> Reviewed:
    web, project, _ = reviewed
    step(web, project, "ready", "go")
    step(web, project, "in review")
    return reviewed


def test_requesting_changes_needs_a_reason_that_is_in_the_history(under_review: Reviewed) -> None:
    web, project, _ = under_review
    step(web, project, "changes requested", status=409)
    step(web, project, "changes requested", "the hinge is on the left")
    entry = web.get(f"/api/projects/{project}/history")[0]
    assert (entry["scope"], entry["text"], entry["who"]) == (
        "state",
        "in review → changes requested: the hinge is on the left",
        "tester",
    )
    assert step(web, project, "ready", "moved it")["state"] == "ready"


def test_approval_needs_a_passed_certificate_or_a_reason(under_review: Reviewed) -> None:
    web, project, number = under_review
    certified(web, project, passed=False)
    (approve,) = [m for m in web.get(f"/api/projects/{project}/review")["moves"] if m["to"] == "approved"]
    assert "the certificate did not pass" in approve["unmet"]
    step(web, project, "approved", status=409)
    for item in web.get(f"/api/projects/{project}/objects"):
        if item["id"] != number:
            web.delete(f"/api/projects/{project}/objects/{item['id']}")
    web.post(f"/api/projects/{project}/objects/{number}/verdicts", {"candidate": "c0", "verdict": "accepted"})
    web.job(run(web, project), "done")
    certified(web, project, passed=True)
    (approve,) = [m for m in web.get(f"/api/projects/{project}/review")["moves"] if m["to"] == "approved"]
    assert approve["unmet"] == []
    assert approve["notes"] == ["1 of 1 joints hold a default: drawer_1_slide"]
    work = Workspace(web.settings.data_dir / "projects" / project / "work")
    drawn = scene("drawer_1")
    (item,) = drawn.objects
    measured: dict[str, Source] = {
        "axis": "inferred",
        "origin": "inferred",
        "lower": "default",
        "limits": "measured",
    }  # of an older run
    (joint,) = item.joints
    shown = replace(item, joints=(replace(joint, sources=measured),))
    work.save("warp", "scene", replace(drawn, objects=(shown,)), {"key": "other", "seconds": 1.0})
    (approve,) = [m for m in web.get(f"/api/projects/{project}/review")["moves"] if m["to"] == "approved"]
    assert approve["notes"] == []  # closed at 0 is no default to check
    assert "lower" not in web.get(f"/api/projects/{project}/scene")["items"][0]["joints"][0]["sources"]
    assert step(web, project, "approved")["state"] == "approved"


def test_an_approved_project_is_read_only_until_reopened(under_review: Reviewed) -> None:
    web, project, number = under_review
    step(web, project, "approved", "good enough for the demo")
    base = f"/api/projects/{project}"
    assert "approved" in web.post(f"{base}/objects/{number}/points", {"frame": 3, "x": 5, "y": 5}, 409)["message"]
    web.post(f"{base}/undo", {}, 409)
    web.post(f"{base}/run", {}, 409)
    web.post(f"{base}/objects/{number}/verdicts", {"candidate": "c1", "verdict": "accepted"}, 409)
    assert len(next(o for o in web.get(f"{base}/objects") if o["id"] == number)["points"]) == 1
    step(web, project, "changes requested", "one more click")
    web.post(f"{base}/objects/{number}/points", {"frame": 3, "x": 5, "y": 5})


def test_the_figures_report_clicks_per_object_and_time_to_approval(under_review: Reviewed) -> None:
    web, project, number = under_review
    before = web.get(f"/api/projects/{project}/figures")
    assert before["upload_to_approval_s"] is None
    web.post(f"/api/projects/{project}/objects/{number}/points", {"frame": 3, "x": 5, "y": 5})
    step(web, project, "approved", "enough")
    after = web.get(f"/api/projects/{project}/figures")
    assert after["clicks"] == before["clicks"] + 1
    assert after["clicks_per_object"] == after["clicks"] / after["objects"]
    assert 0 < after["upload_to_approval_s"] <= after["age_s"]
    assert after["computing_s"] > 0


def test_comments_are_pinned_resolved_reopened_and_in_the_history(reviewed: Reviewed) -> None:
    web, project, number = reviewed
    base = f"/api/projects/{project}"
    on_frame = web.post(f"{base}/comments", {"text": "cut here", "object": number, "frame": 3, "x": 10.5, "y": 20})
    in_scene = web.post(f"{base}/comments", {"text": "too deep", "object": number, "point_world": [0.1, 0.2, 0.3]})
    assert [c["text"] for c in web.get(f"{base}/comments")] == ["cut here", "too deep"]
    assert web.get(f"{base}/comments")[1]["point_world"] == [0.1, 0.2, 0.3]
    assert web.get(f"{base}")["counts"]["open_comments"] == 2
    done = web.patch(f"{base}/comments/{on_frame['id']}", {"resolved": True})
    assert (done["resolved_by"], done["resolved_at"] is not None) == ("tester", True)
    web.patch(f"{base}/comments/{on_frame['id']}", {"resolved": True}, 409)
    web.patch(f"{base}/comments/{in_scene['id']}", {"resolved": True})
    assert web.patch(f"{base}/comments/{in_scene['id']}", {"resolved": False})["resolved_at"] is None
    assert web.get(f"{base}/history")[0]["text"] == "opened again: too deep"
    web.post(f"{base}/comments", {"text": "half a pin", "frame": 3}, 422)
    web.post(f"{base}/comments", {"text": "nobody", "object": 10_000}, 404)


def test_unavailable_and_unknown_backends_are_refused(web: Running) -> None:
    project = web.sample()
    system = web.get("/api/system")
    usual = web.get(f"/api/projects/{project}")
    assert (usual["generator"], usual["matcher"]) == (system["generators"][0]["name"], system["matchers"][0]["name"])
    missing = next(b for b in system["generators"] if not b["available"])
    assert missing["licence"]
    assert missing["reason"]
    web.patch(f"/api/projects/{project}", {"generator": missing["name"]}, 503)
    web.patch(f"/api/projects/{project}", {"matcher": "none-such"}, 422)
    assert web.get(f"/api/projects/{project}") == usual


def test_a_run_uses_the_backends_of_the_project_and_a_change_makes_it_stale(reviewed: Reviewed) -> None:
    web, project, _ = reviewed
    assert web.get(f"/api/projects/{project}")["result"] == "current"
    with writing(web.context.engine) as session:  # as if the other one were installed
        row = queries.project_row(session, project)
        row.generator = "remote"
        keys.note_project(session, row)
    assert web.get(f"/api/projects/{project}")["result"] == "stale"
    with writing(web.context.engine) as session:
        queued = jobs.queue_run(web.context, session, queries.project_row(session, project), schemas.RunRequest())
        assert (queued.payload["generator"], queued.payload["matcher"]) == ("remote", "sift")
