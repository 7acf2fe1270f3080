"""Database engine, SQLite or Postgres: many readers, one writer, durable commits."""

import logging
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, event
from sqlalchemy.exc import DBAPIError
from sqlalchemy.exc import TimeoutError as PoolTimeout
from sqlmodel import Session, create_engine

from app.db import announcing, once, postgres
from app.db.migrations import migrate, require_tables
from app.db.sqlite import explained
from app.db.tables import Bundle, Comment, Event, Project
from app.db.usable import require_usable
from app.errors import Unavailable
from app.settings import BUSY_S

_log = logging.getLogger(__name__)


def open_engine(database: Path | str, *, anew: bool = False, busy_s: float = BUSY_S) -> Engine:
    """The engine of a database, a file or the address of a Postgres, migrated to the newest tables.

    Raises DatabaseUnusable for a file that is not a database, is damaged, is of a newer r2c2r or not writable, and where the
    file is missing beside existing projects (an empty one would hide them), unless it is to be created `anew`. Waits for
    another writer are limited to `busy_s`.
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
    """Context with the engine of `open_engine`, disposed of at the end."""
    engine = open_engine(database, anew=anew)
    try:
        yield engine
    finally:
        engine.dispose()


@contextmanager
def opened_to_read(database: Path) -> Iterator[Engine]:
    """Context with a read-only engine of a database with the newest tables."""
    engine = _engine(database, _prepare_to_read)
    try:
        yield engine
    finally:
        engine.dispose()


def is_shared(engine: Engine) -> bool:
    """Whether several servers may use the database at a time; a file belongs to one server."""
    return engine.dialect.name != "sqlite"


def now(session: Session) -> float:
    """Seconds since 1970 by the database's clock, shared by all its users."""
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
    """Context with one transaction that takes the write lock at its start, so that its reads stay valid until it writes.

    Raises NoSpace when the disk is full, Unavailable when the database does not answer, DatabaseUnusable when it is damaged;
    nothing is stored then. After the commit, the engine's option `projects_changed` is called with the changed projects, and
    `announced` if there are webhook deliveries. Without `lasting`, a Postgres commits asynchronously, for transient data that
    may be lost in a crash.
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
    """A session whose `info` has the ids of projects changed by users or finished jobs."""


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
    except PoolTimeout as error:
        raise Unavailable("all connections to the database are in use", hint="try again in a moment") from error


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
    connection.execute("PRAGMA synchronous=FULL")  # an acknowledged click survives a power cut
    connection.execute("PRAGMA foreign_keys=ON")
    connection.execute("PRAGMA secure_delete=ON")  # deleted content is overwritten


def _begin(connection: Any) -> None:
    write = connection.get_execution_options().get("write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")
