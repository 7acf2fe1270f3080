"""SQLite in WAL mode: many readers, one writer, nothing lost when the process dies."""

import logging
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from alembic.config import Config
from sqlalchemy import Engine, event
from sqlalchemy.exc import OperationalError
from sqlmodel import Session, create_engine

from alembic import command
from app.db import once
from app.errors import NoSpace, Unavailable
from app.settings import shipped

_log = logging.getLogger(__name__)


def open_engine(database: Path) -> Engine:
    """The engine of a database file, migrated to the newest tables."""
    database.parent.mkdir(parents=True, exist_ok=True)
    engine = create_engine(f"sqlite:///{database}", connect_args={"check_same_thread": False, "timeout": 10})
    event.listen(engine, "connect", _prepare)
    event.listen(engine, "begin", _begin)
    migrate(engine)
    return engine


def migrate(engine: Engine, revision: str = "head") -> None:
    """Bring the file to a revision; an empty file becomes a complete one."""
    config = Config()
    config.set_main_option("script_location", str(shipped("alembic", "env.py")).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, revision)


@contextmanager
def reading(engine: Engine) -> Iterator[Session]:
    """A session for reading; raises Unavailable when the database does not answer."""
    with _said_plainly(), Session(engine, expire_on_commit=False) as session:
        yield session


@contextmanager
def writing(engine: Engine) -> Iterator[Session]:
    """One transaction that takes the write lock at its start, so that what it read is still true when it writes.

    Raises NoSpace when the disk is full, Unavailable when the database does not answer: nothing of it is stored then.
    """
    options = engine.execution_options(write=True)
    with _said_plainly(), Session(options, expire_on_commit=False) as session, session.begin():
        once.claim(session)
        yield session


@contextmanager
def _said_plainly() -> Iterator[None]:
    try:
        yield
    except OperationalError as error:
        said = str(error.orig)
        if "disk" in said or "full" in said:
            raise NoSpace("the disk is full", hint="free some space: nothing already made is lost") from error
        _log.warning("the database does not answer: %s", said)
        raise Unavailable("the database does not answer", hint="try again in a moment") from error


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
