"""Servers with a data folder each, on one Postgres and one object store."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from app.errors import Unavailable
from app.files import project_files
from app.jobs.outcomes import FINISHERS
from app.store.mirror import Mirror
from tests.app.conftest import Running, running
from tests.app.object_server import BUCKET, REQUIRED, ObjectServer
from tests.app.postgres import PostgresServer
from tests.app.test_imports import R3D
from tests.app.test_jobs import behave, run
from tests.waiting import PATIENCE_S, held

if not REQUIRED:
    pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")


@pytest.fixture
def two(postgres_server: PostgresServer, tmp_path: Path) -> Iterator[tuple[Running, Running]]:
    shared = {"postgres": postgres_server.of_folder(tmp_path), "store": f"file://{tmp_path / 'store'}", "beat_s": 0.1}
    with (
        running(tmp_path / "a", **shared) as first,
        running(tmp_path / "b", **shared, run_jobs=False) as second,
    ):
        yield first, second
    postgres_server.drop_all()


def test_results_of_one_server_are_shown_and_downloaded_at_another(two: tuple[Running, Running]) -> None:
    first, second = two
    project = first.sample()
    assert second.get(f"/api/projects/{project}/frames")[0]["index"] == 0
    assert (
        second.client.get(f"/media/{project}/frames/0.jpg").content
        == first.client.get(f"/media/{project}/frames/0.jpg").content
    )
    job = second.job(run(second, project), "done")
    assert second.get(f"/api/projects/{project}/bundles")[0]["version"] == 1
    sent = second.client.get(f"/media/{project}/bundles/1.zip")
    assert sent.status_code == 200
    assert sent.content == (first.settings.data_dir / f"projects/{project}/bundles/v1.zip").read_bytes()
    assert second.client.get(f"/api/jobs/{job['id']}/log").status_code == 200
    assert not (second.settings.data_dir / f"projects/{project}/source/Sample kitchen.r3d").exists()  # no page needs it


def test_results_of_a_run_are_in_the_store_before_the_row_is_committed(
    two: tuple[Running, Running], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine that is killed after the row is committed loses no results."""
    first, second = two
    project, finisher = first.sample(), FINISHERS["run"]
    kept: list[bool] = []

    def killed_after(*done: Any) -> None:
        finisher.store(*done)
        second.context.store.fetch(project)
        files = project_files(second.settings.data_dir, project, None)
        kept.append(files.finished_prompts.is_file() and (files.bundles / "v1.zip").is_file())
        raise RuntimeError("killed")

    monkeypatch.setitem(FINISHERS, "run", finisher._replace(store=killed_after))
    second.job(run(second, project), "failed")
    assert kept == [True]


def test_an_unreachable_store_is_reported_and_jobs_wait_for_it(
    two: tuple[Running, Running], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = two
    project = first.sample()
    away = Unavailable("the store of files: it does not answer", hint="try again in a moment")
    with monkeypatch.context() as patched:
        patched.setattr(Mirror, "fetch", lambda *_, **__: _raise(away))
        answer = second.client.get(f"/api/projects/{project}/objects")
        assert (answer.status_code, answer.json()["message"]) == (503, away.message)
    with monkeypatch.context() as patched:
        patched.setattr("app.jobs.runner.AWAY_S", 0.1)
        patched.setattr(Mirror, "keep", lambda *_, **__: _raise(away))
        job = run(first, project)
        first.until(lambda: away.message in first.get(f"/api/jobs/{job}")["message"])
    assert first.job(job, "done", "failed")["state"] == "done"
    assert first.get(f"/api/projects/{project}/bundles")[0]["version"] == 1


def _raise(error: Exception) -> None:
    raise error


def test_a_store_that_hangs_for_one_project_delays_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with held() as released, running(tmp_path / "a", store=f"file://{tmp_path / 'store'}") as web:
        slow, other = web.sample(), web.sample()
        fetches, sound = list[str](), Mirror.fetch

        def fetch(self: Mirror, project_id: str, *, recording: bool = False) -> None:
            fetches.append(project_id)
            if project_id == slow:
                assert released.wait(PATIENCE_S)
            sound(self, project_id, recording=recording)

        monkeypatch.setattr(Mirror, "fetch", fetch)
        with ThreadPoolExecutor(50) as pool:
            frames = [pool.submit(web.client.get, f"/media/{slow}/frames/0.jpg") for _ in range(50)]
            web.until(lambda: slow in fetches)
            assert web.client.get(f"/media/{other}/frames/0.jpg").status_code == 200
            assert not released.is_set()
            released.set()
            assert {frame.result().status_code for frame in frames} == {200}
        assert fetches.count(slow) < 50  # requests that arrive together share one


def test_the_log_of_a_job_is_readable_at_another_server(two: tuple[Running, Running]) -> None:
    first, second = two
    project = first.sample()
    behave(first, project, segment="fail")
    job = second.job(run(second, project), "failed")["id"]
    assert "a traceback that a person may want to read" in second.client.get(f"/api/jobs/{job}/log").text


def test_a_recording_sent_to_one_server_is_read_by_another(two: tuple[Running, Running]) -> None:
    first, second = two
    project = second.post("/api/projects/upload?filename=kitchen.r3d", None, content=R3D)["id"]
    second.until(lambda: second.get(f"/api/projects/{project}")["status"] == "ready")
    source = first.settings.data_dir / f"projects/{project}/source/kitchen.r3d"
    assert source.read_bytes() == R3D


def test_a_permanently_deleted_project_leaves_nothing_in_the_store(two: tuple[Running, Running], tmp_path: Path) -> None:
    first, second = two
    project = first.sample()
    assert list((tmp_path / "store").rglob(f"{project}/files/*"))
    second.delete(f"/api/projects/{project}")
    second.delete(f"/api/trash/{project}")
    assert [path for path in (tmp_path / "store").rglob("*") if path.is_file() and project in str(path)] == []


def test_import_by_path_is_refused_if_other_machines_compute(two: tuple[Running, Running], tmp_path: Path) -> None:
    (tmp_path / "scan.r3d").write_bytes(b"PK")
    refused = two[0].post("/api/projects/import", {"path": str(tmp_path / "scan.r3d")}, 422)
    assert "upload" in refused["hint"]


def test_a_bundle_download_redirects_to_the_store(
    postgres_server: PostgresServer, s3: ObjectServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in s3.environment.items():
        monkeypatch.setenv(name, value)
    with running(tmp_path / "a", postgres=postgres_server.of_folder(tmp_path), store=f"s3://{BUCKET}/stored") as web:
        project = web.sample()
        web.job(run(web, project), "done")
        answer = web.client.get(f"/media/{project}/bundles/1.zip", follow_redirects=False)
        assert answer.status_code == 302
        assert answer.headers["location"].startswith(f"{s3.endpoint}/{BUCKET}/stored/projects/{project}/downloads/")
        assert web.client.get(f"/media/{project}/frames/0.jpg").status_code == 200
    postgres_server.drop_all()
