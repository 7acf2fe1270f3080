"""Folders set aside, for an admin: list, adopt, leave, or discard an upload's bytes."""

import logging
import secrets
import shutil
import time
from pathlib import Path

from app import schemas
from app.db.engine import reading, writing
from app.db.tables import Project, Upload
from app.errors import Conflict, NotFound
from app.files import ProjectFiles, delete_folder, folder_bytes, project_files, safe_name
from app.schemas.description import Description
from app.services import adopting, crossing, imports, probing, projects
from app.services.context import Context
from r2c2r_core.errors import InputError

_log = logging.getLogger(__name__)

LEFT = "left"  # marker file in the folder
_RECORDING = "Recovered.zip"  # the original name was only in the row; an .r3d is a zip as well


def everything(context: Context) -> list[schemas.UnknownFolder]:
    """All folders set aside, by name."""
    return [_shape(context, path) for path in sorted(context.settings.unknown.glob("*"))]


def adopt(context: Context, entry: str) -> schemas.Project:
    """Restore a folder as a project, or complete the existing project from it.

    An upload's bytes are validated by a process: call it behind the gate of looks.
    """
    folder = _found(context, entry)
    if not folder.is_dir():
        return _adopt_upload(context, folder)
    description = adopting.described(folder)
    files = project_files(context.settings.data_dir, description.id)
    only_said = _only_said(folder)
    if not only_said and files.root.exists():
        raise Conflict(f"{files.root} is there already", hint="move one of the two away first")
    if not only_said:
        files.root.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(folder, files.root)
    try:
        bundles = adopting.bundles_in(files, description)
        with writing(context.engine) as session:
            project = adopting.adopt(session, context.settings.data_dir, description, bundles, context.who)
            project.trashed = None  # restored also from the trash
    except BaseException:
        if not only_said:
            shutil.move(files.root, folder)
        raise
    if only_said:
        delete_folder(folder)  # all its content is in the database
    (files.root / LEFT).unlink(missing_ok=True)
    crossing.sees_changed(context)
    shown = projects.get_project(context, description.id)
    if shown.job is not None:  # a job reads its recording again
        context.runner.queued(shown.job.id)
    projects.tell(context, shown.id)
    return shown


def leave(context: Context, entry: str) -> schemas.UnknownFolder:
    """Mark a folder to stay where it is."""
    folder = _found(context, entry)
    if folder.is_dir():
        (folder / LEFT).touch()
    return _shape(context, folder)


def discard(context: Context, entry: str) -> None:
    """Delete the bytes of an upload; a project's folder is never deleted from here."""
    path = _found(context, entry)
    if path.is_dir():
        raise InputError(
            f"{entry} is a folder; only the bytes of an upload can be discarded", hint="adopt it, or leave it there"
        )
    path.unlink()
    _log.warning("%s: discarded by %s", path, context.who)


def _adopt_upload(context: Context, path: Path) -> schemas.Project:
    """A new project from a completely received recording."""
    probing.check_recording(context, path, safe_name(path.name))
    row = Upload(id=secrets.token_hex(6), file_name=_RECORDING, size=path.stat().st_size, who=context.who, created=time.time())
    with writing(context.engine) as session:
        session.add(row)
    return imports.from_finished_upload(context, row, path)


def _found(context: Context, entry: str) -> Path:
    for path in context.settings.unknown.glob("*"):
        if path.name == entry:
            return path
    raise NotFound(f"nothing named {entry!r} was set aside", hint="look at the list again")


def _only_said(folder: Path) -> bool:
    """Whether the folder has only a project.json."""
    return {path.name for path in folder.iterdir()} - {LEFT} == {"project.json"}


def _shape(context: Context, path: Path) -> schemas.UnknownFolder:
    files, why_not = ProjectFiles(path, path / "work"), ""
    description: Description | None = None
    try:
        if path.is_dir():
            description = adopting.described(path)
            why_not = _why_not(context, path, description)
        else:
            probing.check_whole(context, path, "it")
    except InputError as error:
        why_not = str(error)
    live = [entry for entry in description.objects if not entry.deleted] if description else []
    return schemas.UnknownFolder(
        entry=path.name,
        kind=_kind(path, description),
        name=str(description.project["name"]) if description else path.name,
        path=str(path),
        size_bytes=folder_bytes(path) if path.is_dir() else path.stat().st_size,
        changed=description.changed if description else None,
        objects=len(live),
        clicks=sum(len(entry.points) for entry in live),
        bundles=len(list(files.bundles.glob("v*.zip"))),
        recording=any(files.source.glob("*")) or not (path.is_dir() or why_not),
        why_not=why_not,
        left=(path / LEFT).exists(),
    )


def _kind(path: Path, description: Description | None) -> schemas.UnknownKind:
    if not path.is_dir():
        return "upload"
    if description is None:
        return "other"
    return "newer" if _only_said(path) else "project"


def _why_not(context: Context, path: Path, description: Description) -> str:
    with reading(context.engine) as session:
        known = session.get(Project, description.id) is not None
    root = project_files(context.settings.data_dir, description.id).root
    if _only_said(path):
        return "" if known else "its project is not there; adopt the project's folder first"
    return f"{root} is there already; move one of the two away" if root.exists() else ""
