"""Transfer of rows from a SQLite file to Postgres and back: equal rows, and existing ones are never overwritten."""

import sqlite3
from pathlib import Path

import pytest
from sqlmodel import select

from app.backups import backup
from app.db import moving
from app.db.engine import opened, reading, writing
from app.db.moving import TableRows
from app.db.tables import Comment, Project
from r2c2r_core.cli import main
from tests.app.conftest import running
from tests.app.postgres import PostgresServer
from tests.app.test_jobs import run


@pytest.fixture
def worked_on(tmp_path: Path) -> Path:
    """A data folder at rest with clicks, a deleted comment, and a finished run."""
    data = tmp_path / "data"
    with running(data) as web:
        project = web.sample()
        item = web.get(f"/api/projects/{project}/objects")[0]["id"]
        web.post(f"/api/projects/{project}/objects/{item}/points?infer=false", {"frame": 3, "x": 0.1, "y": 2 / 3, "label": 1})
        web.job(run(web, project), "done")
        with writing(web.context.engine) as session:
            for text in ("kept — ünïcode 🍳", "deleted"):
                session.add(Comment(project_id=project, text=text, who="ann", at=1 / 3))
        with writing(web.context.engine) as session:
            session.delete(session.exec(select(Comment).where(Comment.text == "deleted")).one())
    return data


def test_rows_moved_to_postgres_and_back_are_unchanged(
    worked_on: Path, postgres_server: PostgresServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    address, back = postgres_server.of_folder(tmp_path), tmp_path / "back" / "r2c2r.db"
    before = moving.check(worked_on)
    assert {held.table for held in before if held.rows} >= {"projects", "objects", "prompt_points", "jobs", "bundles", "events"}
    assert moving.move(str(worked_on / "r2c2r.db"), address) == before
    with opened(address) as engine, writing(engine) as session:  # ids are not reused
        comment = Comment(project_id=session.exec(select(Project.id)).one(), text="new", who="ann", at=1.0)
        session.add(comment)
        session.flush()
        assert comment.id == 3
        session.delete(comment)
    with running(worked_on, run_jobs=False) as web, running(worked_on, postgres=address, run_jobs=False) as moved:
        (project,) = (shown["id"] for shown in web.get("/api/projects"))
        for at in ("objects", "bundles", "history", "certificate"):
            assert (
                moved.client.get(f"/api/projects/{project}/{at}").json()
                == web.client.get(f"/api/projects/{project}/{at}").json()
            )
    held = moving.move(address, str(back))
    same = {"sign_ins", "launch_keys", "audit"}  # differ, as the browsers above signed in
    assert [each for each in held if each.table not in same] == [each for each in before if each.table not in same]
    with sqlite3.connect(back) as connection:
        assert connection.execute("SELECT seq FROM sqlite_sequence WHERE name='comments'").fetchone() == (3,)
    connection.close()
    assert back.stat().st_mode & 0o077 == 0
    monkeypatch.setenv("R2C2R_DATABASE", address)
    backup(worked_on, tmp_path / "whole")
    assert (tmp_path / "whole" / "projects" / project / "facts.json").is_file()
    assert rows_of(tmp_path / "whole", monkeypatch) == {each.table: each.rows for each in held}
    postgres_server.drop_all()


def test_moving_and_restoring_never_overwrite_existing_rows(
    worked_on: Path, postgres_server: PostgresServer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, address = str(worked_on / "r2c2r.db"), postgres_server.of_folder(tmp_path)
    with opened(address) as engine, writing(engine) as session:
        session.add(Project(id="p", name="p", status="ready", created=0.0, updated=0.0, source_name="s"))
    assert main(["db", "move", file, address]) != 0
    assert "projects hold rows" in capsys.readouterr().err
    with opened(address) as engine, reading(engine) as session:
        assert session.exec(select(Project.id)).all() == ["p"]
    assert main(["db", "move", address, file]) != 0
    assert "is there already" in capsys.readouterr().err
    assert main(["db", "move", str(tmp_path / "none.db"), address]) == 2
    assert main(["db", "restore", file, "--data", str(worked_on)]) == 2  # without a Postgres
    assert "r2c2r restore" in capsys.readouterr().err
    postgres_server.drop_all()


def test_a_move_that_loses_rows_is_rolled_back(
    worked_on: Path, postgres_server: PostgresServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    address, portions = postgres_server.of_folder(tmp_path), moving._rows

    def lossy(connection: object, table: object) -> object:
        postgres = connection.dialect.name == "postgresql"  # type: ignore[attr-defined]
        for rows in portions(connection, table):  # type: ignore[arg-type]
            yield rows[1:] if postgres else rows

    monkeypatch.setattr(moving, "_rows", lossy)
    assert main(["db", "move", str(worked_on / "r2c2r.db"), address]) == 2
    with opened(address) as engine, reading(engine) as session:
        assert session.exec(select(Project.id)).all() == []
    postgres_server.drop_all()


def test_a_postgres_backup_is_restored_into_an_empty_database(
    worked_on: Path,
    postgres_server: PostgresServer,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    first, second = (postgres_server.of_folder(tmp_path / name) for name in "ab")
    kept = tmp_path / "night.db"
    before = moving.move(str(worked_on / "r2c2r.db"), first)
    monkeypatch.setenv("R2C2R_DATABASE", first)
    assert main(["db", "backup", "--data", str(worked_on), "-o", str(kept)]) == 0
    assert main(["db", "backup", "--data", str(worked_on), "-o", str(kept)]) != 0  # existing files are not overwritten
    monkeypatch.setenv("R2C2R_DATABASE", second)
    assert main(["db", "restore", str(kept), "--data", str(worked_on)]) == 0
    assert main(["restore", str(kept), "--data", str(worked_on)]) != 0
    assert "r2c2r db restore" in capsys.readouterr().err
    assert main(["check-data", "--data", str(worked_on)]) == 2  # the remaining file is outdated
    assert "r2c2r db check" in capsys.readouterr().err
    assert moving.check(worked_on) == before
    assert main(["db", "check", "--data", str(worked_on)]) == 0
    assert "prompt_points" in capsys.readouterr().out
    postgres_server.drop_all()


def rows_of(folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    with monkeypatch.context() as patch:
        patch.delenv("R2C2R_DATABASE")
        held: list[TableRows] = moving.check(folder)
    return {each.table: each.rows for each in held}
