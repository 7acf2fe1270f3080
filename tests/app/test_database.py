"""Unusable databases: a one-line error with the next step and exit code 2, before anything is printed or overwritten."""

import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import create_engine

from app.db.engine import open_engine, opened, reading
from app.db.migrations import migrate, revisions
from app.db.sqlite import explained
from app.errors import DatabaseUnusable, Unavailable
from app.services import accounts
from r2c2r_core.cli import main


def garbage(path: Path) -> None:
    path.write_bytes(b"these are no bytes of a database" * 400)


def truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:9000])


def flipped(path: Path) -> None:
    found = bytearray(path.read_bytes())
    for at in range(5000, len(found), 997):
        found[at] ^= 0xFF
    path.write_bytes(found)


def one_table(path: Path) -> None:
    """Root page of a table that is not read when the file is opened."""
    with closing(sqlite3.connect(path)) as connection:
        (size,) = connection.execute("PRAGMA page_size").fetchone()
        (page,) = connection.execute("SELECT rootpage FROM sqlite_master WHERE name = 'comments'").fetchone()
    found = bytearray(path.read_bytes())
    found[(page - 1) * size : page * size] = bytes(size)
    path.write_bytes(found)


def written_by_a_newer_sqlite(path: Path) -> None:
    """Read-only file: its write version is unknown (https://www.sqlite.org/fileformat.html, 1.3.2)."""
    found = bytearray(path.read_bytes())
    found[18] = 3
    path.write_bytes(found)


def a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def sql(statement: str) -> Callable[[Path], None]:
    def run(path: Path) -> None:
        connection = sqlite3.connect(path)
        connection.execute(statement)
        connection.commit()
        connection.close()

    return run


UNUSABLE = {
    "garbage": (garbage, "no database"),
    "truncated": (truncated, "damaged"),
    "flipped": (flipped, "damaged"),
    "one table": (one_table, "damaged"),
    "read only": (written_by_a_newer_sqlite, "may not be written"),
    "folder": (a_folder, "a folder"),
    "newer": (sql("UPDATE alembic_version SET version_num = '9999'"), "revision 9999"),
    "no revision": (sql("DROP TABLE alembic_version"), "which revision"),
    "lost table": (sql("DROP TABLE comments"), "without table comments"),
    "lost column": (sql("ALTER TABLE projects DROP COLUMN review_state"), "without column review_state of table projects"),
}
COMMANDS = (["serve", "--port", "0"], ["user", "list"], ["demo"])


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with an account, as one file."""
    path = tmp_path_factory.mktemp("sound") / "r2c2r.db"
    with opened(path) as engine:
        accounts.add(engine, "ann", "admin", "three plain words")
    return path


@pytest.mark.parametrize("kind", UNUSABLE)
def test_an_unusable_database_is_reported_in_one_line_and_left_unchanged(
    kind: str, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: None)
    path = shutil.copy(sound, tmp_path / "r2c2r.db")
    spoil, said = UNUSABLE[kind]
    spoil(path)
    before = path.read_bytes() if path.is_file() else b""
    for command in COMMANDS:
        assert main([*command, "--data", str(tmp_path)]) == 2
        printed = capsys.readouterr()
        assert (printed.out, printed.err.count("\n")) == ("", 1)
        assert said in printed.err
        assert "; " in printed.err  # the next step
    assert (path.read_bytes() if path.is_file() else b"") == before


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everything")
def test_a_read_only_database_is_reported_in_one_line(sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(sound, tmp_path / "r2c2r.db").chmod(0o400)
    tmp_path.chmod(0o500)
    try:
        assert main(["user", "list", "--data", str(tmp_path)]) == 2
    finally:
        tmp_path.chmod(0o700)
    assert "may not be" in capsys.readouterr().err


def test_exhausted_connections_are_reported_as_unavailable(sound: Path) -> None:
    engine = create_engine(f"sqlite:///{sound}", pool_size=1, max_overflow=0, pool_timeout=0)
    with reading(engine) as session:
        session.connection()
        with pytest.raises(Unavailable, match="all connections to the database are in use"), reading(engine) as second:
            second.connection()
    engine.dispose()


def test_sqlite_errors_are_classified_by_error_code(tmp_path: Path) -> None:
    def said(code: int, text: str) -> str:
        error = sqlite3.OperationalError(text)
        error.sqlite_errorcode = code
        found = explained(error, tmp_path / "r.db")
        return type(found).__name__

    assert said(sqlite3.SQLITE_CORRUPT, "database disk image is malformed") == "DatabaseUnusable"
    assert said(sqlite3.SQLITE_IOERR_WRITE, "disk I/O error") == "DatabaseUnusable"
    assert said(sqlite3.SQLITE_READONLY, "attempt to write a readonly database") == "DatabaseUnusable"
    assert said(sqlite3.SQLITE_FULL, "database or disk is full") == "NoSpace"
    assert said(sqlite3.SQLITE_BUSY_SNAPSHOT, "database is locked") == "Unavailable"
    assert said(sqlite3.SQLITE_CONSTRAINT_UNIQUE, "UNIQUE constraint failed") == "NoneType"


@pytest.mark.parametrize("left", [None, b""])
def test_no_empty_database_is_created_beside_project_folders(
    left: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: None)
    (tmp_path / "projects" / "0123456789ab" / "source").mkdir(parents=True)
    if left is not None:
        (tmp_path / "r2c2r.db").write_bytes(left)
    for command in COMMANDS:
        assert main([*command, "--data", str(tmp_path)]) == 2
        printed = capsys.readouterr()
        assert printed.out == ""
        assert "no database beside 1 project folder" in printed.err
    assert not (tmp_path / "r2c2r.db").exists() or (tmp_path / "r2c2r.db").read_bytes() == b""


def test_a_migration_keeps_a_backup_and_only_the_newest_three_remain(tmp_path: Path) -> None:
    older, path = revisions()[-2], tmp_path / "r2c2r.db"
    engine = create_engine(f"sqlite:///{path}")
    migrate(engine, older)
    engine.dispose()
    sql("INSERT INTO accounts (name, role, password, created) VALUES ('ann', 'admin', '', 0)")(path)
    for turn in range(5):
        copy = tmp_path / "backups" / f"before-{older}-{turn}.db"
        copy.parent.mkdir(exist_ok=True)
        copy.touch()
        os.utime(copy, (turn, turn))
    open_engine(path).dispose()
    kept = sorted((tmp_path / "backups").iterdir(), key=lambda found: found.stat().st_mtime)
    assert len(kept) == 3
    connection = sqlite3.connect(kept[-1])
    assert connection.execute("SELECT version_num FROM alembic_version").fetchone() == (older,)
    assert connection.execute("SELECT name FROM accounts").fetchall() == [("ann",)]
    connection.close()


def test_stored_files_are_readable_by_their_owner_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", __import__("io").StringIO("three plain words\n"))
    was = os.umask(0o022)
    try:
        data = tmp_path / "data"
        assert main(["user", "add", "ann", "--data", str(data)]) == 0
        assert modes(data) == {0o700, 0o600}
        (data / "r2c2r.db").chmod(0o644)
        data.chmod(0o755)
        assert main(["user", "list", "--data", str(data)]) == 0
        assert modes(data) == {0o700, 0o600}  # permissions that an older version left open
        shared = tmp_path / "shared"
        (shared / "other").mkdir(parents=True)
        shared.chmod(0o755)
        assert main(["user", "list", "--data", str(shared)]) == 0
        assert shared.stat().st_mode & 0o777 == 0o755  # it holds other files than ours
        assert (shared / "r2c2r.db").stat().st_mode & 0o777 == 0o600
    finally:
        os.umask(was)


def modes(folder: Path) -> set[int]:
    return {path.stat().st_mode & 0o777 for path in (folder, *folder.rglob("*"))}


def test_opening_an_engine_on_a_damaged_file_raises_database_unusable(tmp_path: Path) -> None:
    garbage(tmp_path / "r2c2r.db")
    with pytest.raises(DatabaseUnusable, match="no database"):
        open_engine(tmp_path / "r2c2r.db")
