"""Re-reading of a recording with its depth registered, on request, and back."""

import json

from app.db.engine import writing
from app.db.tables import Job, Project
from tests.app.conftest import Running


def read_again(web: Running, project: str, registered: bool, status: int = 202) -> dict:
    answer = web.client.put(f"/api/projects/{project}/reading", json={"register_depth": registered})
    assert answer.status_code == status, answer.text
    return answer.json()


def requests(web: Running) -> list[dict]:
    """Requests of the jobs, oldest first."""
    paths = sorted(web.settings.data_dir.rglob("request.json"), key=lambda path: int(path.parent.name))
    return [json.loads(path.read_text()) for path in paths]


def test_rereading_with_registered_depth_makes_the_result_stale(web: Running) -> None:
    project = web.sample()
    web.job(web.post(f"/api/projects/{project}/run", {}, 202)["id"], "done")
    found = read_again(web, project, True)
    assert (found["status"], found["register_depth"], found["result"]) == ("importing", True, "stale")
    web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
    assert requests(web)[-1]["config"] == {"ingest": {"register_depth": True}}
    assert all("config" not in request for request in requests(web)[:-1])
    web.job(web.post(f"/api/projects/{project}/run", {}, 202)["id"], "done")
    assert requests(web)[-1]["config"] == {"ingest": {"register_depth": True}}  # the run uses the same setting
    assert web.get(f"/api/projects/{project}")["counts"]["objects"] > 0  # the clicks are kept
    assert read_again(web, project, False)["register_depth"] is False
    web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
    assert "config" not in requests(web)[-1]
    texts = [entry["text"] for entry in web.get(f"/api/projects/{project}/history") if entry["action"] == "reading"]
    assert texts == ["depth read as it was recorded", "depth registered to the colour images"]


def test_requesting_the_current_reading_starts_no_job(web: Running) -> None:
    project = web.sample()
    before = len(web.get(f"/api/jobs?project={project}"))
    assert read_again(web, project, False)["status"] == "ready"
    assert len(web.get(f"/api/jobs?project={project}")) == before


def test_rereading_during_a_job_is_a_conflict(web: Running) -> None:
    project = web.sample()
    with writing(web.context.engine) as session:
        session.add(Job(project_id=project, kind="run", state="running", payload={}, who="x", created=0.0))
    assert read_again(web, project, True, 409)["kind"] == "conflict"
    with writing(web.context.engine) as session:
        assert session.get(Project, project).register_depth is False
