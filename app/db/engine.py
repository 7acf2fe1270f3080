"""SQLite in WAL mode: many readers, one writer, nothing lost when the process dies."""

import logging
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, event
from sqlalchemy.exc import DatabaseError
from sqlmodel import Session, create_engine

from app.db import once
from app.db.migrations import migrate, require_tables
from app.db.sqlite import explained
from app.db.tables import Bundle, Comment, Event, Project
from app.db.usable import require_usable

_log = logging.getLogger(__name__)


def open_engine(database: Path, *, anew: bool = False) -> Engine:
    """The engine of a database file, migrated to the newest tables.

    Raises DatabaseUnusable for a file that is none, is damaged, is of a newer r2c2r or may not be written, and where there
    is no file beside projects (an empty one would hide them), unless it is to be made `anew`.
    """
    require_usable(database, anew=anew)
    engine = _engine(database, _prepare)
    with _said_plainly(engine):
        migrate(engine)
        require_tables(engine)
    return engine


@contextmanager
def opened(database: Path, *, anew: bool = False) -> Iterator[Engine]:
    """`open_engine` for as long as the block lasts."""
    engine = open_engine(database, anew=anew)
    try:
        yield engine
    finally:
        engine.dispose()


@contextmanager
def opened_to_read(database: Path) -> Iterator[Engine]:
    """The engine of a database of the newest tables, which nothing can be written with, while the block lasts."""
    engine = _engine(database, _prepare_to_read)
    try:
        yield engine
    finally:
        engine.dispose()


@contextmanager
def reading(engine: Engine) -> Iterator[Session]:
    """A session for reading; raises Unavailable when the database does not answer, DatabaseUnusable when it is damaged."""
    with _said_plainly(engine), Session(engine, expire_on_commit=False) as session:
        yield session


@contextmanager
def writing(engine: Engine) -> Iterator[Session]:
    """One transaction that takes the write lock at its start, so that what it read is still true when it writes.

    Raises NoSpace when the disk is full, Unavailable when the database does not answer, DatabaseUnusable when it is damaged:
    nothing of it is stored then. Once it is stored, the engine's option `projects_changed` is told whose rows changed.
    """
    options = engine.execution_options(write=True)
    with _said_plainly(engine), _Writing(options, expire_on_commit=False) as session:
        with session.begin():
            once.claim(session)
            yield session
        tell = options.get_execution_options().get("projects_changed")
        if tell and session.info:
            tell(session.info)


class _Writing(Session):
    """A session whose `info` has the ids of projects that people, or a finished job, changed."""


@event.listens_for(_Writing, "after_flush")
def _note_changed(session: _Writing, _context: Any) -> None:
    for row in (*session.new, *session.dirty):
        if isinstance(row, Project):
            session.info[row.id] = True
        elif isinstance(row, Event | Comment | Bundle):
            session.info[row.project_id] = True


@contextmanager
def _said_plainly(engine: Engine) -> Iterator[None]:
    try:
        yield
    except DatabaseError as error:
        if not isinstance(error.orig, sqlite3.Error):
            raise
        said = explained(error.orig, Path(engine.url.database or ""))
        if said is None:
            raise
        _log.warning("the database: %s", error.orig)
        raise said from error


def _engine(database: Path, prepare: Callable[[sqlite3.Connection, Any], None]) -> Engine:
    engine = create_engine(f"sqlite:///{database}", connect_args={"check_same_thread": False, "timeout": 10})
    event.listen(engine, "connect", prepare)
    event.listen(engine, "begin", _begin)
    return engine


def _prepare_to_read(connection: sqlite3.Connection, _record: Any) -> None:
    connection.isolation_level = None
    connection.execute("PRAGMA query_only=ON")


def _prepare(connection: sqlite3.Connection, _record: Any) -> None:
    connection.isolation_level = None  # the driver's own BEGIN comes too late; _begin does it
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA synchronous=FULL")  # a click that was acknowledged survives a power cut
    connection.execute("PRAGMA foreign_keys=ON")
    connection.execute("PRAGMA busy_timeout=10000")
    connection.execute("PRAGMA secure_delete=ON")  # what was deleted is overwritten


def _begin(connection: Any) -> None:
    write = connection.get_execution_options().get("write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")
