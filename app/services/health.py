"""Readiness check of this server."""

from sqlmodel import select

from app.db.engine import reading
from app.db.tables import Project
from app.services.context import Context


def require_ready(context: Context) -> None:
    """Raise Unavailable or DatabaseUnusable while the database cannot be read."""
    with reading(context.engine) as session:
        session.exec(select(Project.id).limit(1)).first()
