import sqlite3
from pathlib import Path

from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlmodel import SQLModel

from app.db.engine import migrate, open_engine
from app.settings import shipped


def test_an_empty_file_becomes_what_tables_py_says(tmp_path: Path) -> None:
    engine = open_engine(tmp_path / "empty.db")
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True, "render_as_batch": True})
        assert compare_metadata(context, SQLModel.metadata) == []
    engine.dispose()


def test_migrations_can_go_down_and_up_again(tmp_path: Path) -> None:
    engine = open_engine(tmp_path / "round.db")
    migrate(engine)  # twice is once
    engine.dispose()
    assert {"projects", "objects", "events", "jobs"} <= _tables(tmp_path / "round.db")


def test_the_database_is_in_wal_mode_and_keeps_foreign_keys(tmp_path: Path) -> None:
    engine = open_engine(tmp_path / "wal.db")
    with engine.connect() as connection:
        assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
        assert connection.exec_driver_sql("PRAGMA foreign_keys").scalar() == 1
    engine.dispose()


def test_the_migrations_travel_with_the_app() -> None:
    folder = shipped("alembic", "env.py")
    assert (folder / "script.py.mako").is_file()
    assert not (folder / "__init__.py").exists()


def _tables(path: Path) -> set[str]:
    connection = sqlite3.connect(path)
    try:
        return {row[0] for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    finally:
        connection.close()
