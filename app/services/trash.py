"""The trash: complete deleted projects, until an admin restores or permanently deletes them."""

import time

from sqlmodel import Session, col, select

from app import schemas
from app.db import once, queries
from app.db.engine import reading, writing
from app.db.tables import Event, Job, Project
from app.errors import Conflict, NotFound
from app.files import delete_folder
from app.services import crossing, project_shapes, projects
from app.services.context import Context


def put(context: Context, project_id: str) -> schemas.Trashed:
    """Stop the project's processes and move it to the trash: hidden, with all its files."""
    _stop(context, project_id)
    with writing(context.engine) as session:
        row = queries.project_row(session, project_id)
        row.trashed = time.time()
        _note(context, session, row, "trash", "put into the trash")
        session.flush()
        shape = _shape(session, row)
    _changed(context)
    crossing.show_out(context, project_id, "was put into the trash")
    return shape


def everything(context: Context) -> list[schemas.Trashed]:
    """Projects in the trash, newest first."""
    with reading(context.engine) as session:
        rows = session.exec(select(Project).where(col(Project.trashed).is_not(None)).order_by(col(Project.trashed).desc()))
        return [_shape(session, row) for row in rows]


def restore(context: Context, project_id: str) -> schemas.Project:
    """Restore a project from the trash."""
    with writing(context.engine) as session:
        row = _row(session, project_id)
        row.trashed = None
        _note(context, session, row, "restore", "taken out of the trash")
    _changed(context)
    return projects.get_project(context, project_id)


def delete(context: Context, project_id: str) -> schemas.Deleted:
    """Permanently delete rows and files of a trashed project, but not a workspace outside its folder."""
    with reading(context.engine) as session:
        _row(session, project_id)
    context.store.delete(project_id)
    with writing(context.engine) as session:
        row = _row(session, project_id)
        files = context.files(row)
        session.delete(row)
        once.forget(session, project_id=project_id)
    freed = delete_folder(files.root)
    if files.work.is_relative_to(context.settings.data_dir):
        freed += delete_folder(files.work)
    _changed(context)
    return schemas.Deleted(freed_bytes=freed)


def _stop(context: Context, project_id: str) -> None:
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        jobs = session.exec(select(Job.id).where(Job.project_id == project_id, col(Job.state).in_(queries.ACTIVE))).all()
    for job in jobs:
        context.runner.cancel(job or 0)
    if not context.runner.wait_until_idle(project_id, context.settings.kill_grace_s + 5.0):
        raise Conflict("a job of this project is still stopping", hint="try again in a moment")
    crossing.shut(context, project_id)


def _row(session: Session, project_id: str) -> Project:
    row = session.get(Project, project_id)
    if row is None or row.trashed is None:
        raise NotFound(f"no project {project_id} in the trash", hint="look at the trash again")
    return row


def _note(context: Context, session: Session, row: Project, action: str, text: str) -> None:
    now = time.time()
    row.updated = now
    session.add_all([row, Event(project_id=row.id, scope="project", action=action, text=text, who=context.who, at=now)])


def _shape(session: Session, row: Project) -> schemas.Trashed:
    last = select(Event.who).where(Event.project_id == row.id, Event.action == "trash").order_by(col(Event.id).desc())
    return schemas.Trashed(
        id=row.id,
        name=row.name,
        at=row.trashed or 0.0,
        who=session.exec(last).first() or "",
        size_bytes=row.size_bytes,
        counts=project_shapes.counts_of(session, row.id),
    )


def _changed(context: Context) -> None:
    crossing.sees_changed(context)
    context.hub.publish("projects", None)
