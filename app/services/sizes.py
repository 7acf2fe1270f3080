"""How large projects are: measured when their jobs end, and now and then while they are worked on; a list only reads it."""

from sqlmodel import col, select

from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Project
from app.services.context import Context


def measure(context: Context) -> None:
    """Measure the folders of projects that changed since that was done last."""
    with reading(context.engine) as session:
        changed = session.exec(select(Project).where(col(Project.updated) > col(Project.sized))).all()
    for project in changed:
        size = context.store.size(project.id)
        with writing(context.engine) as session:
            queries.note_size(session, project.id, size)
