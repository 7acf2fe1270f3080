"""SQLite files: opening without creating, copying while in use, and mapping of error codes."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.errors import DatabaseUnusable, NoSpace, Unavailable
from app.files import free_bytes
from r2c2r_core.errors import R2C2RError

RESTORE = "r2c2r restore BACKUP --data DIR puts a copy in its place: see docs/data.md"
_ROOM_BYTES = 1 << 20  # with less free space, SQLite's "disk I/O error" means a full disk
_FAULTS = {
    sqlite3.SQLITE_NOTADB: ("no database", RESTORE),
    sqlite3.SQLITE_CORRUPT: ("a damaged database", RESTORE),
    sqlite3.SQLITE_ERROR: ("a database that lacks something", RESTORE),
    sqlite3.SQLITE_IOERR: ("the disk does not read or write it", "check the disk first"),
    sqlite3.SQLITE_READONLY: (
        "may not be written",
        "make yourself the owner of it and its folder, or choose another data folder",
    ),
    sqlite3.SQLITE_PERM: ("may not be opened", "make yourself the owner of it and its folder, or choose another data folder"),
    sqlite3.SQLITE_CANTOPEN: (
        "may not be opened",
        "make yourself the owner of it and its folder, or choose another data folder",
    ),
}


@contextmanager
def connected(database: Path) -> Iterator[sqlite3.Connection]:
    """A connection to an existing file; SQLite's errors are raised as our own."""
    connection = None
    try:
        connection = sqlite3.connect(f"{database.absolute().as_uri()}?mode=rw", uri=True, timeout=10)
        connection.text_factory = lambda raw: raw.decode(errors="replace")  # damage reports quote raw content
        yield connection
    except sqlite3.Error as error:
        raise explained(error, database) or error from error
    except UnicodeDecodeError as error:  # an SQLite message that quotes damaged bytes
        raise DatabaseUnusable(f"{database}: a damaged database", hint=RESTORE) from error
    finally:
        if connection is not None:
            connection.close()


def explained(error: sqlite3.Error, database: Path) -> R2C2RError | None:
    """An SQLite error as one of our errors; None for errors that are not the file's fault, such as a broken constraint.

    SQLite's messages mislead ("database disk image is malformed" is not a full disk); only its codes are reliable
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
    """Raise DatabaseUnusable for a damaged file; `quick_check` skips the consistency of indices with their tables."""
    found = connection.execute(f"PRAGMA {check}(1)").fetchone()[0]
    if found != "ok":
        raise DatabaseUnusable(f"{database}: a damaged database ({found})", hint=RESTORE)


def copy_database(database: Path, target: Path) -> None:
    """Copy a consistent snapshot of the database, even during writes; raises DatabaseUnusable for a damaged one.

    The copy is atomic: it gets its final name once it was verified.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".{target.name}.part")
    part.unlink(missing_ok=True)
    part.touch()
    try:
        with connected(database) as source, connected(part) as copy:
            source.backup(copy)
            copy.execute("PRAGMA journal_mode=DELETE")  # a single file without a -wal beside it
            require_sound(copy, database)
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
