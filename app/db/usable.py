"""Validation of a database file before use, with a one-line error and the next step."""

import sqlite3
from pathlib import Path

from sqlalchemy import Engine
from sqlmodel import Session, select

from app.db.migrations import revisions
from app.db.postgres import shown
from app.db.sqlite import RESTORE, connected, require_sound
from app.db.tables import Project
from app.errors import DatabaseUnusable


def require_usable(database: Path, *, anew: bool = False, to_write: bool = True) -> str | None:
    """The revision of its tables, None where there are none yet; raises DatabaseUnusable for an unusable file.

    Usable is a sound database of a known revision, or a new one. If there are projects already, a new one is refused
    without `anew`, by which they will be adopted. `to_write`: it must also be writable.
    """
    if database.is_dir():
        raise DatabaseUnusable(f"{database}: a folder, where the database should be", hint="move it away")
    revision = _checked(database, to_write) if database.is_file() and database.stat().st_size > 0 else None
    if revision is None and not anew:
        _refuse_beside_projects(database)
    return revision


def require_projects_known(engine: Engine, data_dir: Path) -> None:
    """Raise DatabaseUnusable for a Postgres without projects if the data folder has some, which it would hide."""
    with Session(engine) as session:
        known = session.exec(select(Project.id)).first() is not None
    folders = _project_folders(data_dir)
    if folders and not known:
        raise DatabaseUnusable(
            f"{shown(engine.url)}: no project in the database, but {len(folders)} project folders in {data_dir}",
            hint="r2c2r db move copies the rows here; r2c2r serve --adopt makes new rows from the folders",
        )


def _checked(database: Path, to_write: bool) -> str | None:
    """Its revision after checking soundness, known revision and, if required, writability; None without tables."""
    with connected(database) as connection:
        require_sound(connection, database, "quick_check")
        if to_write:
            connection.execute("BEGIN IMMEDIATE")
            connection.execute("CREATE TABLE of_a_moment (it)")  # BEGIN itself succeeds on a read-only file
            connection.execute("ROLLBACK")
        tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        return _known_revision(connection, database, tables) if tables else None


def _known_revision(connection: sqlite3.Connection, database: Path, tables: set[str]) -> str:
    """The tables' revision; raises DatabaseUnusable where it is missing or unknown."""
    row = connection.execute("SELECT version_num FROM alembic_version").fetchone() if "alembic_version" in tables else None
    if row is None:
        raise DatabaseUnusable(f"{database}: its tables do not say which revision they are", hint=RESTORE)
    known = revisions()
    if row[0] not in known:
        raise DatabaseUnusable(
            f"{database}: revision {row[0]}, where this r2c2r knows {known[0]} to {known[-1]}",
            hint="use the version of r2c2r that made it, or a copy from the folder backups/ beside it",
        )
    return str(row[0])


def _refuse_beside_projects(database: Path) -> None:
    """Raise DatabaseUnusable instead of creating an empty database beside existing projects."""
    folders = _project_folders(database.parent)
    if folders:
        raise DatabaseUnusable(
            f"{database}: no database beside {len(folders)} project folders; an empty one would not know them",
            hint="r2c2r restore brings back a backup; r2c2r serve --adopt makes a new database from the folders",
        )


def _project_folders(data_dir: Path) -> list[Path]:
    return [path for path in data_dir.glob("projects/*") if path.is_dir()]
