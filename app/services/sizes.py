"""Sizes of project folders, measured after jobs and periodically during work, and cached for lists."""

from sqlmodel import col, select

from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Project
from app.services.context import Context


def measure(context: Context) -> None:
    """Measure the folders of projects that changed since the last measurement."""
    with reading(context.engine) as session:
        changed = session.exec(select(Project).where(col(Project.updated) > col(Project.sized))).all()
    for project in changed:
        size = context.store.size(project.id)
        with writing(context.engine) as session:
            queries.note_size(session, project.id, size)
