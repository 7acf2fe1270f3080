import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil
import pytest
from sqlmodel import select

from app.db.engine import open_engine, reading, writing
from app.db.tables import Job
from app.errors import Unavailable
from app.process import started_at
from app.settings import Settings
from tests.app.conftest import Running
from tests.app.served import serve_fakes
from tests.forked import Forked
from tests.waiting import PATIENCE_S

pytestmark = pytest.mark.both_databases
about_workers = pytest.mark.both_databases(quick=False)  # about workers, not rows: the kind of database hardly matters

STAGES = ["segment", "generate", "align", "synthesize", "warp", "export"]


def behave(web: Running, project: str, **stages: str) -> Path:
    folder = web.settings.data_dir / "projects" / project
    (folder / "behave.json").write_text(json.dumps(stages))
    return folder


def run(web: Running, project: str) -> int:
    return int(web.post(f"/api/projects/{project}/run", {}, 202)["id"])


def worker_of(web: Running, job: int) -> int:
    """Process id of the job's worker, 0 before it has one."""
    with reading(web.context.engine) as session:
        row = session.get(Job, job)
        assert row is not None
        return row.worker_pid or 0


def request_of(web: Running, project: str, job: int) -> Path:
    """Folder of the job's request files."""
    return web.settings.data_dir / "projects" / project / "requests" / str(job)


def test_a_run_executes_every_stage_and_stores_its_bundle(web: Running) -> None:
    project = web.sample()
    job = web.job(run(web, project), "done")
    assert [s["name"] for s in job["stages"]] == STAGES
    assert (job["progress"], job["error"], job["eta_s"]) == (1.0, None, None)
    assert (web.settings.data_dir / "projects" / project / "calls.txt").read_text().split() == STAGES
    (bundle,) = web.get(f"/api/projects/{project}/bundles")
    assert (bundle["version"], bundle["passed"], bundle["current"]) == (1, True, True)
    assert web.get(f"/api/projects/{project}/certificate")["drift_m"] == 0.001
    assert web.get(f"/api/projects/{project}")["result"] == "current"
    texts = [event["text"] for event in web.get(f"/api/jobs/{job['id']}/events")]
    assert texts[:1] == ["segment"]
    assert texts[-1] == "done"


def test_a_change_makes_the_result_stale_until_the_next_run(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    web.patch(f"/api/projects/{project}/objects/{number}", {"category": "oven"})
    assert web.get(f"/api/projects/{project}")["result"] == "stale"
    web.job(run(web, project), "done")
    assert [(b["version"], b["current"]) for b in web.get(f"/api/projects/{project}/bundles")] == [(2, True), (1, False)]


def test_a_bundle_unknown_to_a_restored_database_is_not_overwritten(web: Running) -> None:
    project = web.sample()
    unknown = web.settings.data_dir / "projects" / project / "bundles" / "v1.zip"
    unknown.parent.mkdir(parents=True)
    unknown.write_bytes(b"made after the database was copied")
    web.job(run(web, project), "done")
    assert [bundle["version"] for bundle in web.get(f"/api/projects/{project}/bundles")] == [2]
    assert unknown.read_bytes() == b"made after the database was copied"


@about_workers
def test_the_worker_receives_the_current_clicks_and_corrections(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    web.patch(f"/api/projects/{project}/objects/{number}/override", {"hinge": "left", "joint_upper": 1.0, "joint_lower": 0.0})
    web.until(lambda: web.get(f"/api/jobs?project={project}")[0]["state"] == "done")
    given = request_of(web, project, web.get(f"/api/jobs?project={project}")[0]["id"])
    overrides = json.loads((given / "overrides.json").read_text())
    assert overrides["objects"] == {"drawer_1": {"hinge": "left", "joint_limits": [0.0, 1.0]}}
    assert [o["name"] for o in json.loads((given / "prompts.json").read_text())["objects"]] == ["drawer_1", "mug_1"]


@about_workers
def test_a_failed_stage_reports_its_error_and_log_and_can_be_retried(web: Running) -> None:
    project = web.sample()
    folder = behave(web, project, align="fail")
    job = web.job(run(web, project), "failed")
    assert job["error"] == {
        "kind": "object-not-seen",
        "message": "no frame shows drawer_1",
        "hint": "click it on another frame",
        "current": None,
    }
    assert [s["state"] for s in job["stages"]] == ["done", "done", "failed", "waiting", "waiting", "waiting"]
    log = web.client.get(f"/api/jobs/{job['id']}/log")
    assert "a traceback that a person may want to read" in log.text
    (folder / "behave.json").unlink()
    again = web.post(f"/api/jobs/{job['id']}/retry", status=202)
    assert web.job(again["id"], "done")["state"] == "done"
    web.post(f"/api/jobs/{again['id']}/retry", status=409)


@about_workers
def test_a_worker_killed_on_every_attempt_fails_the_job_in_one_line(web: Running) -> None:
    project = web.sample()
    behave(web, project, generate="crash")
    job = web.job(run(web, project), "failed")
    assert job["error"]["kind"] == "worker-died"
    assert "signal 9" in job["error"]["message"]
    assert "\n" not in job["error"]["message"]
    assert job["attempts"] == web.settings.job_attempts


@about_workers
def test_a_job_resumes_after_its_worker_is_killed_once(web: Running) -> None:
    project = web.sample()
    folder = behave(web, project, generate="hang")
    job = run(web, project)
    web.until(lambda: (folder / "hanging").exists() and worker_of(web, job))
    (folder / "behave.json").unlink()
    os.killpg(worker_of(web, job), signal.SIGKILL)
    assert web.job(job, "done", "failed")["state"] == "done"
    assert "taken up again" in str(web.get(f"/api/jobs/{job}/events"))


@about_workers
def test_a_job_waiting_for_memory_reports_the_reason(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
    with start(job_memory_bytes=1 << 60) as web:
        job = run(web, project)
        web.until(lambda: "waits for memory" in web.get(f"/api/jobs/{job}")["message"])
        assert web.post(f"/api/jobs/{job}/cancel")["state"] == "cancelled"


@about_workers
def test_a_worker_that_finished_but_does_not_exit_counts_as_done(web: Running) -> None:
    project = web.sample()
    behave(web, project, generate="lingers")
    assert web.job(run(web, project), "done", "failed")["error"] is None


@about_workers
def test_cancelling_stops_workers_also_if_they_ignore_sigterm(web: Running) -> None:
    for behaviour in ("hang", "deaf"):  # a deaf one ignores SIGTERM
        project = web.sample()
        folder = behave(web, project, generate=behaviour)
        job = run(web, project)
        web.until(lambda folder=folder: (folder / "hanging").exists())
        assert web.post(f"/api/jobs/{job}/cancel")["state"] in ("cancelling", "cancelled")
        assert web.post(f"/api/jobs/{job}/cancel")["state"] in ("cancelling", "cancelled")
        web.job(job, "cancelled")
        assert web.get(f"/api/projects/{project}")["status"] == "ready"


@about_workers
def test_cancelling_answers_before_the_worker_stops(start: Callable[..., Any]) -> None:
    with start(kill_grace_s=PATIENCE_S) as web:  # the deaf worker runs until this test kills it
        project = web.sample()
        folder = behave(web, project, segment="deaf")
        job = run(web, project)
        web.until(lambda: (folder / "hanging").exists() and worker_of(web, job))
        worker = worker_of(web, job)
        try:
            assert web.post(f"/api/jobs/{job}/cancel")["state"] == "cancelling"
            assert _alive(worker)
        finally:
            os.killpg(worker, signal.SIGKILL)
        web.job(job, "cancelled")


def test_heavy_jobs_run_one_at_a_time_and_report_their_queue_position(web: Running) -> None:
    first, second, third = web.sample(), web.sample(), web.sample()
    folder = behave(web, first, segment="hang")
    jobs = [run(web, project) for project in (first, second, third)]
    web.until(lambda: (folder / "hanging").exists())
    assert [web.get(f"/api/jobs/{job}")["position"] for job in jobs] == [None, 1, 2]
    assert web.post(f"/api/jobs/{jobs[1]}/cancel")["state"] == "cancelled"
    web.post(f"/api/jobs/{jobs[0]}/cancel")
    assert web.job(jobs[2], "done")["state"] == "done"


def test_an_import_does_not_wait_for_a_run(web: Running) -> None:
    first, second = web.sample(), web.sample()
    folder = behave(web, first, segment="hang")
    run(web, first)
    web.until(lambda: (folder / "hanging").exists())
    waiting = run(web, second)
    imported = web.sample()  # ready while one run is running and another is queued
    assert web.get(f"/api/projects/{imported}")["status"] == "ready"
    assert web.get(f"/api/jobs/{waiting}")["position"] == 1


def test_a_project_runs_one_job_at_a_time_with_unchanged_inputs(start: Callable[..., Any]) -> None:
    with start(heavy_jobs=2) as web:
        project, other = web.sample(), web.sample()
        folder = behave(web, project, segment="hang")
        first = run(web, project)
        web.until(lambda: (folder / "hanging").exists())
        given = (request_of(web, project, first) / "prompts.json").read_bytes()
        number = web.get(f"/api/projects/{project}/objects")[0]["id"]
        web.patch(f"/api/projects/{project}/objects/{number}", {"category": "oven"})
        second = run(web, project)
        assert second != first
        web.job(run(web, other), "done")  # the second seat takes another project's
        assert web.get(f"/api/jobs/{second}")["state"] == "queued"
        assert (request_of(web, project, first) / "prompts.json").read_bytes() == given
        (folder / "behave.json").unlink()
        web.post(f"/api/jobs/{first}/cancel")
        web.job(second, "done")
        assert "oven" in (request_of(web, project, second) / "prompts.json").read_text()
        assert [b["current"] for b in web.get(f"/api/projects/{project}/bundles")] == [True]


def test_a_resumed_run_keeps_its_original_clicks(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        folder = behave(web, project, generate="hang")
        job = run(web, project)
        web.until(lambda: (folder / "hanging").exists())
        given = (request_of(web, project, job) / "prompts.json").read_bytes()
        number = web.get(f"/api/projects/{project}/objects")[0]["id"]
        web.patch(f"/api/projects/{project}/objects/{number}", {"category": "oven"})
    (folder / "behave.json").unlink()
    with start() as web:
        web.job(job, "done")
        assert (request_of(web, project, job) / "prompts.json").read_bytes() == given
        assert web.get(f"/api/projects/{project}")["result"] == "stale"


def test_requesting_the_same_run_twice_returns_the_same_job(web: Running) -> None:
    project = web.sample()
    folder = behave(web, project, segment="hang")
    job = run(web, project)
    web.until(lambda: (folder / "hanging").exists())
    assert run(web, project) == job
    web.post(f"/api/jobs/{job}/cancel")


@about_workers
def test_a_run_without_clicks_or_with_unknown_backends_is_rejected(web: Running) -> None:
    project = web.sample()
    assert web.post(f"/api/projects/{project}/run", {"matcher": "magic"}, 422)["kind"] == "input"
    for item in web.get(f"/api/projects/{project}/objects"):
        web.delete(f"/api/projects/{project}/objects/{item['id']}")
    assert web.post(f"/api/projects/{project}/run", {}, 422)["kind"] == "prompt"


@about_workers
def test_deleting_a_project_during_its_job_removes_the_folder(web: Running) -> None:
    project = web.sample()
    folder = behave(web, project, generate="hang")
    run(web, project)
    web.until(lambda: (folder / "hanging").exists())
    web.delete(f"/api/projects/{project}")
    web.delete(f"/api/trash/{project}")
    assert not folder.exists()


def test_deleting_a_running_job_stops_it_and_the_queue_continues(web: Running) -> None:
    project = web.sample()
    folder = behave(web, project, generate="hang")
    job = run(web, project)
    web.until(lambda: (folder / "hanging").exists())
    with writing(web.context.engine) as session:
        row = session.get(Job, job)
        assert row is not None
        worker = row.worker_pid or 0
        session.delete(row)
    (folder / "behave.json").unlink()
    assert web.job(run(web, project), "done")["state"] == "done"
    web.until(lambda: not _alive(worker))


@about_workers
def test_a_job_continues_when_its_progress_cannot_be_stored(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    def busy(*_: object) -> None:
        raise Unavailable("the database does not answer")

    project = web.sample()
    monkeypatch.setattr(web.context.runner.rows, "progressed", busy)
    monkeypatch.setattr("app.jobs.runner.STORE_EVERY_S", -1.0)
    assert web.job(run(web, project), "done", "failed")["state"] == "done"


@about_workers
def test_a_job_is_requeued_when_the_server_stops_normally(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        folder = behave(web, project, generate="hang")
        job = run(web, project)
        web.until(lambda: (folder / "hanging").exists())
    (folder / "behave.json").unlink()
    with start() as web:
        assert web.job(job, "done", "failed")["state"] == "done"


def test_a_job_of_a_killed_server_is_resumed_and_its_old_worker_killed(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        settings: Settings = web.settings
    with ended([sys.executable, "-c", "import time; time.sleep(3600)"], start_new_session=True) as orphan:
        engine = open_engine(settings.rows)
        with writing(engine) as session:
            lost = Job(project_id=project, kind="run", state="running", created=time.time(), attempts=1, stage="align")
            lost.worker_pid, lost.worker_started = orphan.pid, started_at(orphan.pid)
            lost.owner = f"{socket.gethostname()}:1:gone"
            session.add(lost)
            session.flush()
            number = lost.id or 0
        engine.dispose()
        with start() as web:
            web.job(number, "done")
            assert "taken up again" in str(web.get(f"/api/jobs/{number}/events"))
            assert orphan.wait(timeout=PATIENCE_S) == -signal.SIGKILL


def test_a_job_interrupted_too_often_fails_with_the_reason(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        settings: Settings = web.settings
    engine = open_engine(settings.rows)
    with writing(engine) as session:
        session.add(Job(project_id=project, kind="run", state="running", created=time.time(), attempts=10))
    engine.dispose()
    with start() as web:
        job = web.get(f"/api/jobs?project={project}")[0]
        assert (job["state"], job["error"]["kind"]) == ("failed", "interrupted")


@about_workers
def test_a_job_interrupted_by_restarts_survives_a_killed_worker(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        folder = behave(web, project, segment="hang")
        settings: Settings = web.settings
    engine = open_engine(settings.rows)
    with writing(engine) as session:
        session.add(Job(project_id=project, kind="run", state="running", created=time.time(), attempts=5))
    engine.dispose()
    with start() as web:
        with reading(web.context.engine) as session:
            job = session.exec(select(Job).where(Job.kind == "run")).one().id or 0
        web.until(lambda: (folder / "hanging").exists() and worker_of(web, job))
        (folder / "behave.json").unlink()
        os.killpg(worker_of(web, job), signal.SIGKILL)
        assert web.job(job, "done", "failed")["state"] == "done"


def test_a_killed_server_loses_no_clicks_and_the_next_one_continues(start: Callable[..., Any], tmp_path: Path) -> None:
    with start() as web:
        project = web.sample()
        folder = behave(web, project, generate="hang")
        settings: Settings = web.settings
    engine = open_engine(settings.rows)
    with writing(engine) as session:
        session.add(Job(project_id=project, kind="run", state="queued", created=time.time()))
    server = Forked(serve_fakes, settings.data_dir)
    try:
        Running.until(lambda: (folder / "hanging").exists())
    finally:
        server.kill()
    with writing(engine) as session:
        (job,) = session.exec(select(Job).where(Job.kind == "run"))
        was, worker = job.state, job.worker_pid
        assert worker is not None
        job.heartbeat = 0.0  # expired: servers that share a database rely on the heartbeat
        session.add(job)
    engine.dispose()
    (folder / "behave.json").unlink()
    try:
        assert was == "running"
        with start() as web:
            web.job(job.id or 0, "done")
            assert "taken up again" in str(web.get(f"/api/jobs/{job.id}/events"))
            assert len(web.get(f"/api/projects/{project}/objects")) == 2
        Running.until(lambda: not _alive(worker))
    finally:
        with suppress(psutil.Error):
            psutil.Process(worker).kill()


@contextmanager
def ended(command: list[str], **options: Any) -> Iterator[subprocess.Popen[bytes]]:
    """A process that is killed with the block, unless it ended before."""
    process = subprocess.Popen(command, **options)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
