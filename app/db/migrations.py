"""Schema migrations; a copy of an older database file is kept."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, inspect
from sqlmodel import SQLModel

from alembic import command
from app.db.postgres import shown
from app.db.sqlite import RESTORE, copy_database
from app.errors import DatabaseUnusable
from app.settings import shipped

KEPT_COPIES = 3  # of databases before a migration


def migrate(engine: Engine, revision: str = "head") -> None:
    """Migrate the database to a revision; an empty one gets all tables, an older file is copied to backups/ first."""
    if engine.dialect.name == "sqlite":
        _migrate_file(engine, revision)
    else:
        _migrate_server(engine, revision)


def _migrate_server(engine: Engine, revision: str) -> None:
    """Migrate in one transaction under the write lock, so that only one of several starting servers migrates."""
    config, known = _config(), revisions()
    with engine.execution_options(write=True).begin() as connection:
        now = MigrationContext.configure(connection).get_current_revision()
        if now is not None and now not in known:
            found = f"revision {now}, where this r2c2r knows {known[0]} to {known[-1]}"
            raise DatabaseUnusable(f"{shown(engine.url)}: {found}", hint="use the version of r2c2r that made it")
        if _is_newest(now, revision):
            return
        config.attributes["connection"] = connection
        command.upgrade(config, revision)


def _migrate_file(engine: Engine, revision: str) -> None:
    config = _config()
    with engine.begin() as connection:
        now = MigrationContext.configure(connection).get_current_revision()
    if _is_newest(now, revision):
        return
    if now not in (None, revisions()[-1]):
        _keep_copy(Path(engine.url.database or ""), str(now))
    with _without_foreign_keys(engine) as connection, connection.begin():
        before = _loose_rows(connection)
        config.attributes["connection"] = connection
        command.upgrade(config, revision)
        loose = _loose_rows(connection) - before
        if loose > 0:  # the transaction is rolled back
            found = f"{loose} rows would refer to missing rows in revision {revision}"
            raise DatabaseUnusable(f"{engine.url.database}: {found}, none expected", hint=RESTORE)


def _is_newest(now: str | None, revision: str) -> bool:
    return revision == "head" and now == revisions()[-1]


@cache  # it reads all migrations
def revisions() -> tuple[str, ...]:
    """All revisions, oldest first."""
    return tuple(script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions())[::-1]


def require_tables(engine: Engine) -> None:
    """Raise DatabaseUnusable for a database whose tables differ from tables.py, regardless of its revision."""
    found = inspect(engine)
    names = set(found.get_table_names())
    for table in SQLModel.metadata.sorted_tables:
        columns = {column["name"] for column in found.get_columns(table.name)} if table.name in names else set()
        missing = sorted({column.name for column in table.columns} - columns)
        if missing:
            what = f"column {', '.join(missing)} of table {table.name}" if columns else f"table {table.name}"
            raise DatabaseUnusable(
                f"{engine.url.database}: a database without {what}",
                hint=RESTORE,
            )


@contextmanager
def _without_foreign_keys(engine: Engine) -> Iterator[Connection]:
    """A connection without foreign keys, as dropping a rebuilt table's old version would delete all rows referring to it.

    SQLite's own procedure (https://www.sqlite.org/lang_altertable.html, section 7); the pragma does nothing in a transaction.
    """
    with engine.connect() as connection:
        driver = connection.connection.driver_connection
        assert driver is not None
        kept = driver.execute("PRAGMA foreign_keys").fetchone()[0]
        driver.execute("PRAGMA foreign_keys=OFF")
        try:
            yield connection
        finally:
            driver.execute(f"PRAGMA foreign_keys={kept}")


def _loose_rows(connection: Connection) -> int:
    """Number of rows with dangling references."""
    return len(connection.exec_driver_sql("PRAGMA foreign_key_check").fetchall())


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(shipped("alembic", "env.py")).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config


def _keep_copy(database: Path, revision: str) -> None:
    """Copy the file, named by its revision, and delete the oldest such copies."""
    folder = database.parent / "backups"
    copy_database(database, folder / f"before-{revision}-{time.strftime('%Y%m%d-%H%M%S')}.db")
    copies = sorted(folder.glob("before-*.db"), key=lambda path: path.stat().st_mtime)
    for path in copies[:-KEPT_COPIES]:
        path.unlink()
