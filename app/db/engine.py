"""The rows, in a SQLite file or a Postgres: many readers, one writer, nothing lost when the process dies."""

import logging
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, event
from sqlalchemy.exc import DBAPIError
from sqlmodel import Session, create_engine

from app.db import announcing, once, postgres
from app.db.migrations import migrate, require_tables
from app.db.sqlite import explained
from app.db.tables import Bundle, Comment, Event, Project
from app.db.usable import require_usable
from app.settings import BUSY_S

_log = logging.getLogger(__name__)


def open_engine(database: Path | str, *, anew: bool = False, busy_s: float = BUSY_S) -> Engine:
    """The engine of a database, a file or the address of a Postgres, migrated to the newest tables.

    Raises DatabaseUnusable for a file that is none, is damaged, is of a newer r2c2r or may not be written, and where there
    is no file beside projects (an empty one would hide them), unless it is to be made `anew`. Who uses it waits for another's
    writing, up to `busy_s`.
    """
    if isinstance(database, str):
        engine = postgres.postgres_engine(database, busy_s)
    else:
        require_usable(database, anew=anew)
        engine = _engine(database, _prepare, busy_s)
    with _said_plainly(engine):
        migrate(engine)
        require_tables(engine)
    return engine


@contextmanager
def opened(database: Path | str, *, anew: bool = False) -> Iterator[Engine]:
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


def is_shared(engine: Engine) -> bool:
    """Whether more than one server may use it at a time; a file is one server's."""
    return engine.dialect.name != "sqlite"


def now(session: Session) -> float:
    """Seconds since 1970 by the clock that everybody who uses the database shares."""
    if session.get_bind().dialect.name == "sqlite":
        return time.time()
    return float(session.execute(postgres.NOW).scalar_one())


@contextmanager
def reading(engine: Engine) -> Iterator[Session]:
    """A session for reading; raises Unavailable when the database does not answer, DatabaseUnusable when it is damaged."""
    with _said_plainly(engine), Session(engine, expire_on_commit=False) as session:
        yield session


@contextmanager
def writing(engine: Engine, *, lasting: bool = True) -> Iterator[Session]:
    """One transaction that takes the write lock at its start, so that what it read is still true when it writes.

    Raises NoSpace when the disk is full, Unavailable when the database does not answer, DatabaseUnusable when it is damaged:
    nothing of it is stored then. Once it is stored, the engine's option `projects_changed` is told whose rows changed, and
    `announced` is called where webhooks are to hear of it. What is not `lasting` is shown for a moment: nobody waits until it
    is on the disk of a Postgres, which may lose the last of it when it crashes.
    """
    options = engine.execution_options(write=True, lasting=lasting)
    with _said_plainly(engine), _Writing(options, expire_on_commit=False) as session:
        with session.begin():
            once.claim(session)
            yield session
        listening = options.get_execution_options()
        announced = session.info.pop(announcing.ANNOUNCED, False)
        if announced and "announced" in listening:
            listening["announced"]()
        if session.info and "projects_changed" in listening:
            listening["projects_changed"](session.info)


class _Writing(Session):
    """A session whose `info` has the ids of projects that people, or a finished job, changed."""


event.listen(_Writing, "before_flush", announcing.announce)


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
    except DBAPIError as error:
        if isinstance(error.orig, sqlite3.Error):
            said = explained(error.orig, Path(engine.url.database or ""))
        else:
            said = postgres.explained(error, engine.url)
        if said is None:
            raise
        _log.warning("the database: %s", error.orig)
        raise said from error


def _engine(database: Path, prepare: Callable[[sqlite3.Connection, Any], None], busy_s: float = BUSY_S) -> Engine:
    engine = create_engine(f"sqlite:///{database}", connect_args={"check_same_thread": False, "timeout": busy_s})
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
    connection.execute("PRAGMA secure_delete=ON")  # what was deleted is overwritten


def _begin(connection: Any) -> None:
    write = connection.get_execution_options().get("write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")
