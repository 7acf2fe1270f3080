"""The database as a file: read without making one, copied while it is in use, and what SQLite's codes mean."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.errors import DatabaseUnusable, NoSpace, Unavailable
from app.files import free_bytes
from r2c2r_core.errors import R2C2RError

RESTORE = "r2c2r restore BACKUP DATA puts a copy in its place: see docs/data.md"
_ROOM_BYTES = 1 << 20  # with less than that free, SQLite's "disk I/O error" is a full disk
_FAULTS = {
    sqlite3.SQLITE_NOTADB: ("no database", RESTORE),
    sqlite3.SQLITE_CORRUPT: ("a damaged database", RESTORE),
    sqlite3.SQLITE_ERROR: ("a database that lacks something", RESTORE),
    sqlite3.SQLITE_IOERR: ("the disk does not read or write it", "look after the disk before anything else"),
    sqlite3.SQLITE_READONLY: ("may not be written", "make it and its folder yours, or choose another data folder"),
    sqlite3.SQLITE_PERM: ("may not be opened", "make it and its folder yours, or choose another data folder"),
    sqlite3.SQLITE_CANTOPEN: ("may not be opened", "make it and its folder yours, or choose another data folder"),
}


@contextmanager
def connected(database: Path) -> Iterator[sqlite3.Connection]:
    """A connection to a file that is there; what SQLite finds wrong with it is raised as one of our errors."""
    connection = None
    try:
        connection = sqlite3.connect(f"{database.absolute().as_uri()}?mode=rw", uri=True, timeout=10)
        connection.text_factory = lambda raw: raw.decode(errors="replace")  # reports on damage quote what they found
        yield connection
    except sqlite3.Error as error:
        raise explained(error, database) or error from error
    except UnicodeDecodeError as error:  # a message of SQLite that quotes damaged bytes
        raise DatabaseUnusable(f"{database}: a damaged database", hint=RESTORE) from error
    finally:
        if connection is not None:
            connection.close()


def explained(error: sqlite3.Error, database: Path) -> R2C2RError | None:
    """What SQLite says, as one of our errors; None for what is no fault of the file, such as a broken constraint.

    SQLite's texts mislead ("database disk image is malformed" is no full disk): only its codes tell
    (https://www.sqlite.org/rescode.html); the low byte is the class.
    """
    code = getattr(error, "sqlite_errorcode", None)
    if code is None:
        return None
    kind = code & 0xFF
    full = kind == sqlite3.SQLITE_IOERR and free_bytes(database.parent) < _ROOM_BYTES
    if kind == sqlite3.SQLITE_FULL or full:
        return NoSpace("the disk is full", hint="free some space: nothing already made is lost")
    if kind in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        return Unavailable("the database does not answer", hint="try again in a moment")
    what = _FAULTS.get(kind)
    return DatabaseUnusable(f"{database}: {what[0]} ({error})", hint=what[1]) if what else None


def require_sound(connection: sqlite3.Connection, database: Path, check: str = "integrity_check") -> None:
    """Raise DatabaseUnusable for a damaged file; `quick_check` leaves out whether indices agree with their tables."""
    found = connection.execute(f"PRAGMA {check}(1)").fetchone()[0]
    if found != "ok":
        raise DatabaseUnusable(f"{database}: a damaged database ({found})", hint=RESTORE)


def copy_database(database: Path, target: Path) -> None:
    """Copy the database as it is at one moment, whoever writes meanwhile; raises DatabaseUnusable for a damaged one.

    The copy is whole or not there: it gets its name once it was found sound.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".{target.name}.part")
    part.unlink(missing_ok=True)
    part.touch()
    try:
        with connected(database) as source, connected(part) as copy:
            source.backup(copy)
            copy.execute("PRAGMA journal_mode=DELETE")  # one file: what is carried away has no -wal beside it
            require_sound(copy, database)
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
