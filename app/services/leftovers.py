"""What a crash left on the disk and nothing knows of any more: deleted once it is old enough to be nobody's beginning."""

import time
from pathlib import Path

from sqlmodel import select

from app.db.engine import reading
from app.db.tables import Project, Upload
from app.files import delete_folder
from app.services.context import Context

OLD_S = 3600.0  # what begins just now has no row yet


def tidy(context: Context) -> None:
    """Delete bytes in the uploads folder that belong to no upload, and folders of projects that are none."""
    with reading(context.engine) as session:
        uploads = set(session.exec(select(Upload.id)))
        known = uploads | set(session.exec(select(Project.id)))
    for path in context.settings.uploads.glob("*"):
        if path.stem not in uploads and _is_old(path):
            path.unlink(missing_ok=True)
    for folder in (context.settings.data_dir / "projects").glob("*"):
        if folder.name not in known and _is_old(folder):
            delete_folder(folder)


def _is_old(path: Path) -> bool:
    try:
        return path.lstat().st_mtime < time.time() - OLD_S
    except FileNotFoundError:
        return False
