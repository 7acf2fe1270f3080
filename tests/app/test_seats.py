"""Seats that take jobs from one database: their state, permission to join, and draining."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sqlmodel import select

from app import work
from app.db.engine import reading
from app.db.tables import Job
from app.jobs import seats
from app.settings import Settings
from app.store.mirror import Mirror
from r2c2r_core.errors import EnvironmentProblem
from tests.app.conftest import FAKE_COMMANDS, ORIGIN, SOCKETS, Running, running
from tests.app.object_server import REQUIRED
from tests.app.postgres import PostgresServer
from tests.app.test_imports import R3D
from tests.app.test_jobs import behave, run
from tests.app.test_sharing import held

if not REQUIRED:
    pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")


@pytest.fixture
def shared(postgres_server: PostgresServer, tmp_path: Path) -> Iterator[dict[str, Any]]:
    yield {
        "postgres": postgres_server.of_folder(tmp_path),
        "store": f"file://{tmp_path / 'store'}",
        "beat_s": 0.1,
    }
    postgres_server.drop_all()


@contextmanager
def seat(web: Running, folder: Path) -> Iterator[threading.Thread]:
    """`r2c2r work` on a data folder of its own."""
    stopping, settings = threading.Event(), replace(web.settings, data_dir=folder, heavy_jobs=1)
    folder.mkdir(exist_ok=True)
    thread = threading.Thread(target=work.run_jobs, args=(settings, FAKE_COMMANDS, stopping))
    thread.start()
    try:
        yield thread
    finally:
        stopping.set()
        thread.join()


def shown(web: Running) -> Any:
    return web.get("/api/seats")


def test_a_server_that_runs_no_jobs_shows_results_of_seats(shared: dict[str, Any], tmp_path: Path) -> None:
    with running(tmp_path / "web", **shared, heavy_jobs=0) as web, seat(web, tmp_path / "one"), seat(web, tmp_path / "two"):
        project = web.post("/api/projects/upload?filename=kitchen.r3d", None, content=R3D)["id"]
        web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
        web.post("/api/projects/sample", {}, 202)
        project = web.sample()
        with web.client.websocket_connect(f"{SOCKETS}/api/live?project={project}", headers={"Origin": ORIGIN}) as tab:
            job = run(web, project)
            told = iter(lambda: tab.receive_json(), None)
            assert any(one["type"] == "job" and one["job"]["id"] == job and one["job"]["state"] == "done" for one in told)
        assert web.get(f"/api/projects/{project}/bundles")[0]["version"] == 1
        with reading(web.context.engine) as session:
            owners = set(session.exec(select(Job.owner)))
        assert web.context.runner.rows.owner not in owners


def test_a_seat_continues_after_an_unexpected_error(
    shared: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tidied, sound = list[int](), Mirror.tidy

    def fail_once(self: Mirror, in_use: frozenset[str]) -> None:
        tidied.append(len(tidied))
        if len(tidied) == 1:
            raise RuntimeError("unexpected")
        sound(self, in_use)

    with running(tmp_path / "web", **shared, heavy_jobs=0) as web:
        monkeypatch.setattr(Mirror, "tidy", fail_once)
        with seat(web, tmp_path / "one"):
            web.until(lambda: len(tidied) > 1)


def test_a_run_continues_at_another_seat_after_its_seat_ends(shared: dict[str, Any], tmp_path: Path) -> None:
    with running(tmp_path / "web", **shared, heavy_jobs=0) as web:
        with seat(web, tmp_path / "one"):
            project = web.sample()
        behave(web, project, warp="hang")
        web.context.store.keep(project)
        with seat(web, tmp_path / "one"):
            job = run(web, project)
            web.until(lambda: (tmp_path / f"one/projects/{project}/hanging").exists())
        (tmp_path / f"web/projects/{project}/behave.json").unlink()
        web.context.store.keep(project)
        with seat(web, tmp_path / "two"):
            assert web.job(job, "done", "failed")["state"] == "done"
        request = (tmp_path / f"two/projects/{project}/requests/{job}/request.json").read_text()
        assert str(tmp_path / "two") in request
        assert str(tmp_path / "one") not in request


def test_the_log_of_a_job_at_a_seat_is_readable_and_the_job_cancellable(shared: dict[str, Any], tmp_path: Path) -> None:
    with running(tmp_path / "web", **shared, heavy_jobs=0) as web, seat(web, tmp_path / "one"):
        project = web.sample()
        behave(web, project, segment="hang")
        web.context.store.keep(project)
        job = run(web, project)
        web.until(lambda: (tmp_path / f"one/projects/{project}/hanging").exists())
        log = tmp_path / f"one/projects/{project}/logs/job-{job}.log"
        log.write_text("half way\n")
        web.until(lambda: "half way" in web.client.get(f"/api/jobs/{job}/log").text)
        (at,) = [one for one in shown(web)["seats"] if one["jobs"]]
        assert (at["here"], at["jobs"][0]["id"], at["jobs"][0]["stage"]) == (False, job, "segment")
        web.post(f"/api/jobs/{job}/cancel")
        assert web.job(job, "cancelled", "done", "failed")["state"] == "cancelled"


def test_a_draining_seat_finishes_its_job_and_exits(shared: dict[str, Any], tmp_path: Path) -> None:
    with running(tmp_path / "web", **shared, heavy_jobs=0) as web, seat(web, tmp_path / "one") as one:
        project, _ = held(web, "drawer_1")
        web.context.store.keep(project)
        job = run(web, project)
        there = tmp_path / f"one/projects/{project}"
        web.until((there / "at-drawer_1.part").exists)
        (number,) = [found["id"] for found in shown(web)["seats"] if not found["here"]]
        web.patch(f"/api/seats/{number}", {"draining": True})
        (there / "hold-drawer_1").unlink()
        web.until(lambda: not one.is_alive())
        assert web.job(job, "done")["state"] == "done"
        waiting = run(web, project)
        assert web.get(f"/api/jobs/{waiting}")["state"] == "queued"
        assert shown(web)["waiting"] == 1
        assert [found["here"] for found in shown(web)["seats"]] == [True]


def test_a_seat_of_another_version_is_refused_in_one_line(
    shared: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with running(tmp_path / "web", **shared) as web:
        monkeypatch.setattr(seats, "version", lambda: "9.9 of another day")
        with pytest.raises(EnvironmentProblem, match=r"^this is r2c2r 9\.9 of another day, and the seat .*") as refused:
            work.run_jobs(replace(web.settings, data_dir=tmp_path / "one"), FAKE_COMMANDS, threading.Event())
        assert "\n" not in str(refused.value)


def test_a_server_on_sqlite_is_the_only_seat(tmp_path: Path) -> None:
    with running(tmp_path) as web:
        (one,) = shown(web)["seats"]
        assert (one["here"], one["jobs_at_a_time"], shown(web)["shared"]) == (True, 1, False)
        assert web.client.patch("/api/seats/0", json={"draining": True}).status_code == 409


def test_a_worker_on_a_sqlite_database_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EnvironmentProblem, match="in a file"):
        work.work(data_dir=tmp_path)
    assert Settings(data_dir=tmp_path).postgres == ""
