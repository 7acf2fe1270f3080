"""Files in the data folder without a database row: set aside for an admin, never deleted.

A row may be missing because of a crash, but also because the database was lost or an older one restored. Only files marked
as incomplete are deleted: a mesh that was being received, the folder of an upload that was deleted while it was becoming
a project.
"""

import logging
import shutil
import time
from pathlib import Path

from sqlmodel import select

from app.db.engine import reading
from app.db.tables import Project, Upload
from app.files import delete_folder, free_name, half_received, project_files
from app.services.context import Context

_log = logging.getLogger(__name__)

OLD_S = 3600.0  # minimum age, as new files have no row yet


def tidy(context: Context) -> None:
    """Delete abandoned incomplete files; move other unknown ones to `unknown/`."""
    data = context.settings.data_dir
    with reading(context.engine) as session:
        uploads = set(session.exec(select(Upload.id)))
        projects = set(session.exec(select(Project.id)))
    for path in context.settings.uploads.glob("*"):
        if path.stem in uploads or not _is_old(path):
            continue
        if half_received(path):
            path.unlink(missing_ok=True)
        else:
            set_aside(context.settings.unknown, path)
    for folder in (data / "projects").glob("*"):
        half_made = project_files(data, folder.name).half_made
        if folder.name in projects or (half_made and folder.name in uploads) or not _is_old(folder):
            continue
        if half_made or context.store.was_deleted(folder.name):
            delete_folder(folder)
        else:
            set_aside(context.settings.unknown, folder)


def set_aside(unknown: Path, path: Path) -> Path:
    """Move a file or folder to an unused name in `unknown/`, and return its path."""
    target = free_name(unknown, path.name)
    unknown.mkdir(parents=True, exist_ok=True)
    shutil.move(path, target)
    _log.warning("%s: the database does not know it; moved to %s, where an admin can adopt it", path, target)
    return target


def _is_old(path: Path) -> bool:
    try:
        return path.lstat().st_mtime < time.time() - OLD_S
    except FileNotFoundError:
        return False
