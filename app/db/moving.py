"""`r2c2r db`: copying rows between databases (SQLite files or Postgres), verified by counts and hashes."""

import contextlib
import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import JSON, Connection, Engine, Table, Text, cast, func, select, text
from sqlmodel import SQLModel

from app.db.engine import open_engine, opened, reading, writing
from app.db.migrations import revisions
from app.db.postgres import shown
from app.db.sqlite import copy_database
from app.db.tables import Message
from app.db.usable import require_usable
from app.errors import Conflict, DatabaseUnusable
from app.files import only_server
from app.settings import Settings
from r2c2r_core.disk import resolved
from r2c2r_core.errors import InputError
from r2c2r_core.progress import SILENT, Progress

AT_ONCE = 1000  # rows
Address = Path | str


@dataclass(frozen=True, slots=True)
class TableRows:
    """Number and digest of a table's rows."""

    table: str
    rows: int
    digest: str  # of all rows, independent of order


def move(source: str, target: str, *, progress: Progress = SILENT) -> list[TableRows]:
    """Copy every row into an empty database, a new file or the address of a Postgres; the source is unchanged.

    Nothing is stored unless the copied rows of each table equal the source's. Raises InputError for a missing source,
    Conflict for a non-empty target or a file in use by a server.
    """
    source_at, target_at = _address(source), _address(target)
    if isinstance(target_at, Path) and target_at.exists():
        raise Conflict(f"{target_at}: is there already", hint="choose a new name: databases are never overwritten")
    with _at_rest(source_at), opened(source_at) as old:
        return _into(old, target_at, progress)


def backup(data_dir: Path, target: Path, *, progress: Progress = SILENT) -> None:
    """Write the rows to one SQLite file, even while a server runs; raises InputError where there are none."""
    settings = Settings(data_dir=resolved(data_dir))
    if target.exists():
        raise Conflict(f"{target}: is there already", hint="choose a new name: backups are never overwritten")
    copy_rows(settings, target.absolute(), progress)


def copy_rows(settings: Settings, target: Path, progress: Progress = SILENT) -> None:
    """Write a consistent snapshot of the configured database to a new SQLite file."""
    if isinstance(settings.rows, Path):
        copy_database(_existing(settings.rows), target)
        return
    with opened(settings.rows) as engine:
        _into(engine, target, progress)


def restore(source: Path, data_dir: Path, *, progress: Progress = SILENT) -> list[TableRows]:
    """Copy a SQLite file's rows into the empty Postgres of the settings."""
    settings = Settings(data_dir=resolved(data_dir))
    if isinstance(settings.rows, Path):
        raise InputError("R2C2R_DATABASE is not set: the database is a file", hint=f"r2c2r restore {source} --data {data_dir}")
    return move(str(source), settings.rows, progress=progress)


def check(data_dir: Path) -> list[TableRows]:
    """Counts and digests of all tables of a sound database; raises DatabaseUnusable where its tables differ from r2c2r's."""
    settings = Settings(data_dir=resolved(data_dir))
    if isinstance(settings.rows, Path):
        require_usable(_existing(settings.rows), to_write=False)
    with opened(settings.rows) as engine, reading(engine) as session:
        connection = session.connection()
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        found = context.get_current_revision()
        if found != revisions()[-1]:
            raise DatabaseUnusable(f"revision {found}, expected {revisions()[-1]}", hint="start this r2c2r once: it migrates")
        if differing := compare_metadata(context, SQLModel.metadata):
            raise DatabaseUnusable(
                f"the tables differ from the expected ones: {str(differing[0])[:200]}", hint="restore a backup"
            )
        return [_held(connection, table) for table in _kept_tables()]


def _into(old: Engine, target: Address, progress: Progress) -> list[TableRows]:
    """Fill a database; a file gets its final name once it is complete."""
    if isinstance(target, str):
        with opened(target) as new:
            return _copied(old, new, progress)
    target.parent.mkdir(parents=True, exist_ok=True)
    os.umask(0o077)  # it contains password hashes
    part = target.with_name(f".{target.name}.arriving")
    part.unlink(missing_ok=True)
    try:
        engine = open_engine(part, anew=True)
        try:
            found = _copied(old, engine, progress)
        finally:
            engine.dispose()
        copy_database(part, target)  # without SQLite's companion files
        return found
    finally:
        for left in part.parent.glob(f"{part.name}*"):
            left.unlink()


def _copied(old: Engine, new: Engine, progress: Progress) -> list[TableRows]:
    tables: list[Table] = _kept_tables()
    held: list[TableRows] = []
    with reading(old) as source, writing(new) as target:
        reads, writes = source.connection(), target.connection()
        filled = [table.name for table in tables if writes.execute(select(table).limit(1)).first()]
        if filled:
            raise Conflict(f"{shown(new.url)}: {', '.join(filled)} hold rows", hint="choose an empty database")
        for number, table in enumerate(tables):
            progress.at(number / len(tables), f"rows of {table.name}")
            for rows in _rows(reads, table):
                writes.execute(_insert(table, new), rows)
            before, after = _held(reads, table), _held(writes, table)
            if before != after:
                raise DatabaseUnusable(
                    f"{table.name}: {after.rows} of {before.rows} rows arrived, or their content differs", hint="report it"
                )
            _go_on_counting(writes, table, _counted(reads, table))
            held.append(after)
    return held


def _kept_tables() -> list[Table]:
    """All tables except transient messages between servers."""
    return [table for table in SQLModel.metadata.sorted_tables if table.name != Message.__tablename__]


def _rows(connection: Connection, table: Table) -> Iterator[list[dict[str, Any]]]:
    """The rows in batches, with JSON documents as stored text."""
    columns = [cast(column, Text).label(column.name) if _is_document(column) else column for column in table.columns]
    found = connection.execute(select(*columns).execution_options(yield_per=AT_ONCE))
    for portion in found.mappings().partitions():
        yield [dict(row) for row in portion]


def _insert(table: Table, engine: Engine) -> Any:
    typed = engine.dialect.name == "postgresql"
    marks = [f"CAST(:{c.name} AS json)" if typed and _is_document(c) else f":{c.name}" for c in table.columns]
    names = ", ".join(f'"{c.name}"' for c in table.columns)
    return text(f"INSERT INTO {table.name} ({names}) VALUES ({', '.join(marks)})")


def _held(connection: Connection, table: Table) -> TableRows:
    total = count = 0
    for rows in _rows(connection, table):
        count += len(rows)
        total += sum(int.from_bytes(hashlib.sha256(repr(list(row.values())).encode()).digest()) for row in rows)
    return TableRows(table.name, count, f"{total % 2**256:064x}"[:16])


def _counted(connection: Connection, table: Table) -> int | None:
    """The largest id ever used in the table, so that none is reused; None for tables without ids."""
    if not _is_numbered(table):
        return None
    largest = connection.execute(select(func.max(table.c.id))).scalar() or 0
    if connection.dialect.name == "postgresql":
        sequence = connection.execute(_SEQUENCE, {"table": table.name}).scalar()
        ever = connection.exec_driver_sql(f"SELECT CASE WHEN is_called THEN last_value ELSE 0 END FROM {sequence}").scalar()
    else:
        ever = connection.execute(text("SELECT seq FROM sqlite_sequence WHERE name=:table"), {"table": table.name}).scalar()
    return max(largest, ever or 0)


def _go_on_counting(connection: Connection, table: Table, ever: int | None) -> None:
    if not ever:
        return
    given = {"table": table.name, "ever": ever}
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT setval(pg_get_serial_sequence(:table, 'id'), :ever)"), given)
    elif table.dialect_options["sqlite"]["autoincrement"]:
        connection.execute(text("DELETE FROM sqlite_sequence WHERE name=:table"), {"table": table.name})
        connection.execute(text("INSERT INTO sqlite_sequence (name, seq) VALUES (:table, :ever)"), given)


_SEQUENCE = text("SELECT pg_get_serial_sequence(:table, 'id')")


def _is_numbered(table: Table) -> bool:
    return "id" in table.columns and table.columns["id"].type.python_type is int


def _is_document(column: Any) -> bool:
    return isinstance(column.type, JSON)


def _address(named: str) -> Address:
    return named if "://" in named else Path(named).expanduser().absolute()


def _existing(database: Path) -> Path:
    if not database.is_file():
        raise InputError(f"{database}: no such file", hint="name the data folder")
    return database


@contextlib.contextmanager
def _at_rest(source: Address) -> Iterator[None]:
    """Context that locks a file against servers, as concurrent changes would be missing in the copy."""
    if isinstance(source, str):
        yield
        return
    require_usable(_existing(source), to_write=False)
    with only_server(source.parent):
        yield
