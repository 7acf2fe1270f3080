"""`r2c2r backup` and `r2c2r restore`: copies of the data folder.

A backup is one database file, or a folder with that file and the projects' files. Neither command deletes anything.
"""

import shutil
import time
from dataclasses import dataclass
from pathlib import Path

from app.db.moving import copy_rows
from app.db.sqlite import copy_database
from app.db.usable import require_usable
from app.errors import Conflict
from app.files import folder_bytes, only_server, require_free
from app.settings import DATABASE, Settings
from r2c2r_core.disk import keep_private, resolved
from r2c2r_core.errors import InputError
from r2c2r_core.progress import SILENT, Progress

LEFT_OUT = {"previews"}  # subfolders of a project: recreated on demand


@dataclass(frozen=True, slots=True)
class Moved:
    """Amounts copied by a backup or a restore."""

    database_bytes: int
    projects: int
    files: int
    files_bytes: int


def backup(data_dir: Path, target: Path, *, progress: Progress = SILENT) -> Moved:
    """Copy the database, and with it the projects' files unless `target` ends in .db; the server may run meanwhile.

    Raises InputError where the target exists or there is no database, NoSpace, DatabaseUnusable for a damaged one.
    """
    settings, target = Settings(data_dir=resolved(data_dir)), target.expanduser().absolute()
    if target.exists():
        raise InputError(f"{target}: is there already", hint="choose a new name: backups are never overwritten")
    size = _require_rows(settings)
    only_database = target.suffix == ".db"
    files = 0 if only_database else folder_bytes(_projects(settings))
    require_free(target.parent, size + files, settings.min_free_bytes)
    progress.at(0.0, "copying the database")
    if only_database:
        copy_rows(settings, target)
        return Moved(target.stat().st_size, 0, 0, 0)
    part = target.with_name(f".{target.name}.part")
    copy_rows(settings, part / DATABASE)  # first: files are written before their rows, so all files named in it exist
    moved = _copy_missing(_projects(settings), part / "projects", files, progress.part(0.1, 1.0))
    part.rename(target)
    return Moved((target / DATABASE).stat().st_size, *moved)


def restore(source: Path, data_dir: Path, *, progress: Progress = SILENT) -> Moved:
    """Replace the database by a backup's, and add missing files; existing files are kept.

    The replaced database is kept in backups/. Raises EnvironmentProblem while a server runs on the folder.
    """
    settings, source = Settings(data_dir=resolved(data_dir)), source.expanduser().absolute()
    database = source / DATABASE if source.is_dir() else source
    if not database.is_file():
        raise InputError(f"{database}: no such file", hint="give a .db file or a folder made by r2c2r backup")
    if database.resolve() == settings.database:
        raise Conflict(f"{database}: this is the database itself", hint="name a backup")
    if settings.postgres:
        raise Conflict("the database is a Postgres", hint=f"r2c2r db restore {database}, and copy the folder projects/")
    require_usable(database, to_write=False)
    keep_private(settings.data_dir, DATABASE)
    with only_server(settings.data_dir):
        files = folder_bytes(source / "projects") if source.is_dir() else 0
        require_free(settings.data_dir, database.stat().st_size + files, 0)
        progress.at(0.0, "copying the database")
        arriving = settings.data_dir / f".{DATABASE}.arriving"
        copy_database(database, arriving)
        _keep_replaced(settings)
        arriving.rename(settings.database)
        moved = (0, 0, 0)
        if source.is_dir():
            moved = _copy_missing(source / "projects", _projects(settings), files, progress.part(0.1, 1.0))
    return Moved(settings.database.stat().st_size, *moved)


def _require_rows(settings: Settings) -> int:
    """Size of the database file in bytes, 0 for a Postgres; raises InputError where there is none."""
    if settings.postgres:
        return 0
    if not settings.database.is_file():
        raise InputError(f"{settings.database}: no such file", hint="give the data folder: r2c2r backup --data DIR -o OUT")
    require_usable(settings.database)
    return settings.database.stat().st_size


def _projects(settings: Settings) -> Path:
    return settings.data_dir / "projects"


def _keep_replaced(settings: Settings) -> None:
    """Move the database away with SQLite's companion files, as even a damaged one may be needed later."""
    kept = settings.data_dir / "backups" / f"replaced-{time.strftime('%Y%m%d-%H%M%S')}"
    for path in settings.data_dir.glob(f"{DATABASE}*"):
        kept.mkdir(parents=True, exist_ok=True)
        path.rename(kept / path.name)


def _copy_missing(source: Path, target: Path, there: int, progress: Progress) -> tuple[int, int, int]:
    """Copy missing files from `there` bytes in total; returns numbers of projects and files, and bytes copied."""
    projects, files, size = set(), 0, 0
    for path in source.rglob("*"):
        progress.at(size / max(there, 1), f"copying files {files}")
        parts = path.relative_to(source).parts
        place = target.joinpath(*parts)
        if path.is_symlink() or not path.is_file() or place.exists() or len(parts) < 2 or parts[1] in LEFT_OUT:
            continue
        part = place.with_name(f".{place.name}.part")
        place.parent.mkdir(parents=True, exist_ok=True)
        try:
            shutil.copy2(path, part)
        except FileNotFoundError:  # replaced or deleted by the running server
            continue
        part.rename(place)
        projects.add(parts[0])
        files, size = files + 1, size + place.stat().st_size
    return len(projects), files, size
