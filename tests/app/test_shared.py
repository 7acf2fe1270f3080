"""Servers that share a Postgres: a job is taken over from a silent server, which then no longer writes to it."""

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy import Engine, event
from sqlalchemy.exc import OperationalError, ProgrammingError
from sqlmodel import select

from app.db.engine import opened, reading, writing
from app.db.postgres import explained
from app.db.tables import Job, Project, Upload
from app.errors import NotFound
from app.hub import Hub
from app.jobs.outcomes import FINISHERS, job_ended
from app.jobs.rows import JobRows
from app.settings import Settings
from app.store.protocol import Folder
from r2c2r_core.cli import main
from tests.app.conftest import running
from tests.app.postgres import PostgresServer
from tests.app.test_jobs import behave, run
from tests.waiting import LOOK_S, PATIENCE_S, held, until


@pytest.fixture
def engine(postgres_server: PostgresServer, tmp_path: Path) -> Iterator[Engine]:
    with opened(postgres_server.of_folder(tmp_path)) as found:
        yield found
    postgres_server.drop_all()


def a_server(engine: Engine, tmp_path: Path) -> JobRows:
    return JobRows(engine, Hub(), Settings(data_dir=tmp_path), Folder(tmp_path / "projects"), FINISHERS, job_ended)


def waiting(engine: Engine, *projects: str) -> None:
    with writing(engine) as session:
        for name in projects:
            session.add(Project(id=name, name=name, status="ready", created=0.0, updated=0.0, source_name="s"))
            session.flush()
            session.add(Job(project_id=name, kind="run", state="queued", created=0.0))


def test_job_progress_commits_asynchronously_and_job_ends_synchronously(engine: Engine, tmp_path: Path) -> None:
    """Otherwise each progress update would hold the lock of all writers until the disk has synchronised."""
    waiting(engine, "p")
    server, asked = a_server(engine, tmp_path), list[str]()
    event.listen(engine, "before_cursor_execute", lambda *said: asked.append(said[2]))

    def waits(change: Callable[[], object]) -> bool:
        asked.clear()
        change()
        return not any("synchronous_commit TO off" in statement for statement in asked)

    number = server.claim() or 0
    assert not waits(lambda: server.progressed(number, "segment", 0.5, "half", 0.1, None))
    assert not waits(server.beat)
    assert waits(lambda: server.got_further(number, 1))
    assert waits(lambda: server.end(number, "failed", {"kind": "stage", "message": "it failed", "hint": ""}))


def test_no_two_servers_claim_the_same_job(engine: Engine, tmp_path: Path) -> None:
    waiting(engine, *(f"p{number}" for number in range(12)))
    claimed: list[int] = []

    def claim_all() -> None:
        server = a_server(engine, tmp_path)
        while (number := server.claim()) is not None:
            claimed.append(number)

    threads = [threading.Thread(target=claim_all) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(claimed) == len(set(claimed)) == 12


def test_a_starting_server_takes_no_jobs_from_a_live_one(engine: Engine, tmp_path: Path) -> None:
    waiting(engine, "p")
    first, second = a_server(engine, tmp_path), a_server(engine, tmp_path)
    number = first.claim()
    assert number is not None
    second.recover()
    assert second.claim() is None
    assert first.beat() == {number: False}
    assert second.beat() == {}


def test_a_job_without_heartbeat_is_taken_over_and_its_old_owner_locked_out(engine: Engine, tmp_path: Path) -> None:
    waiting(engine, "p")
    first, second = a_server(engine, tmp_path), a_server(engine, tmp_path)
    number = first.claim() or 0
    silent(engine, number)
    second.recover()
    assert second.claim() == number
    before = stored(engine, number)
    for change in (
        lambda: first.progressed(number, "warp", 0.5, "late", 0.9, None),
        lambda: first.finish(number),
        lambda: first.end(number, "failed", {"kind": "late", "message": "late"}),
        lambda: first.queue_again(number, "late"),
        lambda: first.give_back(number, "late"),
        lambda: first.got_further(number, 5),
    ):
        with pytest.raises(NotFound, match="is run by"):
            change()
    assert stored(engine, number) == before
    assert first.beat() == {}


def test_a_heartbeat_keeps_the_ownership_of_a_job(engine: Engine, tmp_path: Path) -> None:
    waiting(engine, "p")
    first, second = a_server(engine, tmp_path), a_server(engine, tmp_path)
    number = first.claim() or 0
    silent(engine, number)
    first.beat()
    second.recover()
    assert stored(engine, number)["owner"] == first.owner


def test_a_job_cancelled_at_another_server_stops_where_it_runs(postgres_server: PostgresServer, tmp_path: Path) -> None:
    rows, data = postgres_server.of_folder(tmp_path), tmp_path / "data"
    with running(data, postgres=rows, beat_s=0.1) as first, running(data, postgres=rows, run_jobs=False) as second:
        project = first.sample()
        folder = behave(first, project, generate="hang")
        job = run(second, project)
        first.until(lambda: (folder / "hanging").exists())
        second.post(f"/api/jobs/{job}/cancel")
        assert second.job(job, "cancelled", "done", "failed")["state"] == "cancelled"
        (folder / "behave.json").unlink()
        assert first.job(run(first, project), "done")["state"] == "done"  # it runs other jobs
    postgres_server.drop_all()


def test_concurrent_writers_are_serialized_without_lost_updates(engine: Engine) -> None:
    waiting(engine, "p")

    def count_up() -> None:
        for _ in range(20):
            with writing(engine) as session:
                project = session.get_one(Project, "p")
                project.size_bytes += 1
                session.add(project)

    threads = [threading.Thread(target=count_up) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with reading(engine) as session:
        assert session.get_one(Project, "p").size_bytes == 80


def test_a_read_transaction_sees_one_snapshot(engine: Engine) -> None:
    waiting(engine, "p")
    with reading(engine) as session:
        assert len(session.exec(select(Project.id)).all()) == 1
        waiting(engine, "q")
        assert len(session.exec(select(Project.id)).all()) == 1


def test_an_upload_size_of_a_tebibyte_is_stored(engine: Engine) -> None:
    with writing(engine) as session:
        session.add(Upload(id="u", file_name="f", size=2**40, who="w", created=0.0))
    with reading(engine) as session:
        assert session.get_one(Upload, "u").size == 2**40


def test_postgres_errors_are_classified_by_sqlstate(engine: Engine) -> None:
    def said(state: str | None) -> str:
        orig = Exception("of a language nobody here speaks")
        orig.sqlstate = state  # type: ignore[attr-defined]
        return type(explained(OperationalError("SELECT", None, orig), engine.url)).__name__

    assert said("53100") == "NoSpace"
    assert {said(state) for state in (None, "55P03", "57P01", "40001", "08006", "53300")} == {"Unavailable"}
    assert {said(state) for state in ("42P01", "XX001", "25006")} == {"DatabaseUnusable"}
    assert said("23505") == "NoneType"
    with pytest.raises(ProgrammingError), writing(engine) as session:
        session.connection().exec_driver_sql("SELEC 1")


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("postgresql+psycopg://nobody:secret@127.0.0.1:1/none", "does not answer"),
        ("mysql://host/name", "not postgresql+psycopg://USER@HOST/NAME"),
        ("elsewhere.db", "not postgresql+psycopg://USER@HOST/NAME"),
    ],
)
def test_an_unreachable_database_is_reported_in_one_line_without_password(
    address: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("psycopg", reason="no psycopg: pip install 'r2c2r[postgres]'")
    monkeypatch.setenv("R2C2R_DATABASE", address)
    assert main(["user", "list", "--data", str(tmp_path)]) in (1, 2)
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert "secret" not in said


def test_an_empty_postgres_beside_project_folders_is_refused(
    postgres_server: PostgresServer, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: None)
    monkeypatch.setenv("R2C2R_DATABASE", postgres_server.of_folder(tmp_path))
    (tmp_path / "projects" / "0123456789ab" / "source").mkdir(parents=True)
    assert main(["serve", "--port", "0", "--data", str(tmp_path)]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "no project in the database, but 1 project folders" in printed.err
    assert "r2c2r db move" in printed.err
    assert main(["serve", "--port", "0", "--adopt", "--data", str(tmp_path)]) == 0
    postgres_server.drop_all()


def test_heartbeats_continue_after_any_error_and_while_the_store_hangs(
    postgres_server: PostgresServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beats, published, sound = list[int](), threading.Event(), JobRows.beat

    def beat(self: JobRows) -> dict[int, bool]:
        beats.append(len(beats))
        if len(beats) == 1:
            raise RuntimeError("unexpected")
        return sound(self)

    def keep_log(self: Folder, project_id: str, log: Path) -> None:
        published.set()
        released.wait(PATIENCE_S)

    monkeypatch.setattr(JobRows, "beat", beat)
    monkeypatch.setattr(Folder, "keep_log", keep_log)
    with held() as released, running(tmp_path, postgres=postgres_server.of_folder(tmp_path), beat_s=LOOK_S) as web:
        until(lambda: len(beats) > 1)
        web.post("/api/projects/sample", {}, 202)
        assert published.wait(PATIENCE_S)
        count = len(beats)
        until(lambda: len(beats) > count + 1)
        released.set()
    postgres_server.drop_all()


def silent(engine: Engine, number: int) -> None:
    with writing(engine) as session:
        row = session.get_one(Job, number)
        row.heartbeat = time.time() - 3600.0
        session.add(row)


def stored(engine: Engine, number: int) -> dict[str, object]:
    with reading(engine) as session:
        return session.get_one(Job, number).model_dump()
