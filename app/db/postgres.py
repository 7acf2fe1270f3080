"""Postgres backend for several servers, with the same tables and guarantees as SQLite.

A writer holds an advisory lock until its transaction ends, so that there is one writer at a time as with SQLite, and its
reads stay valid until it writes; readers see a consistent snapshot.
"""

import math
from typing import Any

from sqlalchemy import URL, Engine, create_engine, event, make_url, text
from sqlalchemy.exc import ArgumentError, DBAPIError

from app.errors import DatabaseUnusable, NoSpace, Unavailable
from r2c2r_core.errors import EnvironmentProblem, InputError, R2C2RError

DRIVER = "postgresql+psycopg"
NOW = text("SELECT extract(epoch FROM clock_timestamp())")
WRITER = 0x72326332  # the advisory lock of writers; migrations take it too
_READ = "SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY"
_WRITE = f"SELECT pg_advisory_xact_lock({WRITER})"
_WRITE_SOON = f"SET LOCAL synchronous_commit TO off; {_WRITE}"
# by class of https://www.postgresql.org/docs/current/errcodes-appendix.html: connection, rollback, resources, operator
_PASSING = ("08", "40", "53", "55", "57")
_FAULTS = {
    "42P01": "a database that lacks something",
    "42703": "a database that lacks something",
    "42501": "may not be written",
    "25006": "may not be written",
    "XX001": "a damaged database",
    "XX002": "a damaged database",
}


def postgres_engine(address: str, busy_s: float) -> Engine:
    """The engine of a Postgres; raises InputError for an address of another kind, EnvironmentProblem without the driver.

    Waits for the write lock and for connections are limited to `busy_s`.
    """
    url, waits = _checked(address), {"options": f"-c lock_timeout={1000 * busy_s:.0f}ms", "connect_timeout": math.ceil(busy_s)}
    try:
        engine = create_engine(
            url,
            connect_args={**waits, "application_name": "r2c2r"},
            pool_pre_ping=True,  # a restarted Postgres is detected before a request fails on it
            pool_size=10,
            max_overflow=20,
        )
    except ModuleNotFoundError as error:
        raise EnvironmentProblem(f"no module {error.name}", hint="pip install 'r2c2r[postgres]'") from error
    event.listen(engine, "begin", _begin)
    return engine


def shown(url: URL) -> str:
    """The address without its password."""
    return url.render_as_string(hide_password=True)


def explained(error: DBAPIError, url: URL) -> R2C2RError | None:
    """A Postgres error as one of our errors; None for errors that are not the server's fault, such as a broken constraint."""
    state = getattr(error.orig, "sqlstate", None)
    if state == "53100":
        return NoSpace("the disk of the database is full", hint="free some space: nothing already made is lost")
    if state in _FAULTS:
        return DatabaseUnusable(f"{shown(url)}: {_FAULTS[state]} ({state})", hint="r2c2r db check says what is wrong")
    if state is None or state[:2] in _PASSING:  # none: no answer at that address
        return Unavailable("the database does not answer", hint="try again in a moment")
    return None


def _checked(address: str) -> URL:
    try:
        url = make_url(address)
    except ArgumentError as error:
        raise _unknown(address) from error
    if url.drivername not in (DRIVER, "postgresql"):
        raise _unknown(url.drivername)
    return url.set(drivername=DRIVER)


def _unknown(found: str) -> InputError:
    return InputError(f"R2C2R_DATABASE {found[:80]!r}: not {DRIVER}://USER@HOST/NAME", hint="leave it out for a SQLite file")


def _begin(connection: Any) -> None:
    options = connection.get_execution_options()
    writes = _WRITE if options.get("lasting", True) else _WRITE_SOON
    connection.exec_driver_sql(writes if options.get("write", False) else _READ)
