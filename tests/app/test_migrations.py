import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import create_engine
from sqlmodel import SQLModel

from alembic import command
from app.db.engine import migrate, open_engine
from app.settings import shipped

FIRST_TABLES = ("projects", "objects", "prompt_points", "verdicts", "overrides", "jobs", "job_events", "events", "bundles")


def test_migrating_an_empty_file_gives_the_schema_of_the_models(tmp_path: Path) -> None:
    engine = open_engine(tmp_path / "empty.db")
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True, "render_as_batch": True})
        assert compare_metadata(context, SQLModel.metadata) == []
    engine.dispose()


def test_all_migrations_can_be_undone_and_applied_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "round.db"
    open_engine(path).dispose()
    before = _schema(path)
    monkeypatch.setenv("R2C2R_DATABASE", f"sqlite:///{path}")
    config = Config()
    config.set_main_option("script_location", str(shipped("alembic", "env.py")))
    config.set_main_option("path_separator", "os")
    command.downgrade(config, "base")
    assert set(_schema(path)) == {"alembic_version"}
    command.upgrade(config, "head")
    assert _schema(path) == before


def test_migrating_a_migrated_database_again_keeps_its_tables(tmp_path: Path) -> None:
    engine = open_engine(tmp_path / "round.db")
    migrate(engine)  # a repeated migration does nothing
    engine.dispose()
    assert {"projects", "objects", "events", "jobs"} <= _tables(tmp_path / "round.db")


def test_migrations_keep_rows_that_refer_to_a_recreated_table(tmp_path: Path) -> None:
    path = tmp_path / "first.db"
    engine = create_engine(f"sqlite:///{path}")
    migrate(engine, "0001")
    engine.dispose()
    with closing(sqlite3.connect(path)) as connection, connection:
        before = {table: _filled(connection, table) for table in FIRST_TABLES}
    open_engine(path).dispose()  # connections of this engine enforce foreign keys
    with closing(sqlite3.connect(path)) as connection:
        after = {table: connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0] for table in before}
    assert before == after == dict.fromkeys(before, 1)


def test_the_database_uses_wal_mode_and_enforces_foreign_keys(tmp_path: Path) -> None:
    engine = open_engine(tmp_path / "wal.db")
    with engine.connect() as connection:
        assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
        assert connection.exec_driver_sql("PRAGMA foreign_keys").scalar() == 1
    engine.dispose()


def test_the_migrations_are_packaged_with_the_app() -> None:
    folder = shipped("alembic", "env.py")
    assert (folder / "script.py.mako").is_file()
    assert not (folder / "__init__.py").exists()


def _filled(connection: sqlite3.Connection, table: str) -> int:
    """Insert a row with a value in every required column and references to the first row of other tables."""
    columns = connection.execute(f"PRAGMA table_info({table})").fetchall()
    referring = {row[3] for row in connection.execute(f"PRAGMA foreign_key_list({table})")}
    values: dict[str, object] = {}
    for _, name, kind, wanted, default, primary in columns:
        if name in referring or primary or (wanted and default is None):
            values[name] = "{}" if "JSON" in kind else 1
    marks = ",".join("?" * len(values))
    connection.execute(f"INSERT INTO {table} ({','.join(values)}) VALUES ({marks})", list(values.values()))
    return int(connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0])


def _schema(path: Path) -> dict[str, list[tuple[Any, ...]]]:
    """Every table's columns, by its name."""
    with closing(sqlite3.connect(path)) as connection:
        names = _tables(path) - {"sqlite_sequence"}
        return {name: connection.execute(f"PRAGMA table_info({name})").fetchall() for name in names}


def _tables(path: Path) -> set[str]:
    connection = sqlite3.connect(path)
    try:
        return {row[0] for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    finally:
        connection.close()
