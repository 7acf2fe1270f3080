"""Comments with positions, and their resolution."""

import time
from typing import Any

from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Comment, Event
from app.errors import Conflict, NotFound
from app.services import overlays, projects
from app.services.context import Context

SCOPE = "comments"


def list_comments(context: Context, project_id: str) -> list[schemas.Comment]:
    """All comments, oldest first."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        rows = session.exec(select(Comment).where(Comment.project_id == project_id).order_by(col(Comment.id)))
        return [shape(row) for row in rows]


def add(context: Context, project_id: str, body: schemas.CommentIn) -> schemas.Comment:
    """Add a comment on the project, an object, a pixel or a point; a pixel on the object's mesh also gets its 3D point."""
    point = body.point_world
    if point is None and body.object is not None and body.frame is not None:
        found = overlays.point_under(context, project_id, body.object, body.frame, body.x or 0.0, body.y or 0.0)
        point = (found[0], found[1], found[2]) if found else None
    with writing(context.engine) as session:
        queries.project_row(session, project_id)
        if body.object is not None:
            queries.object_row(session, project_id, body.object)
        fields = body.model_dump(exclude={"object", "point_world"})
        row = Comment(project_id=project_id, object_id=body.object, who=context.who, at=time.time(), **fields)
        row.point_world = list(point) if point else None
        session.add(row)
        session.flush()
        _note(context, session, row, "comment", f"commented: {body.text}", {"comment": row.id})
        stored = shape(row)
    _tell(context, project_id)
    return stored


def change(context: Context, project_id: str, comment_id: int, body: schemas.CommentPatch) -> schemas.Comment:
    """Resolve or reopen a comment."""
    with writing(context.engine) as session:
        queries.project_row(session, project_id)
        row = session.get(Comment, comment_id)
        if row is None or row.project_id != project_id:
            raise NotFound(f"no comment {comment_id} in this project")
        if body.resolved == (row.resolved_at is not None):
            state = "resolved" if body.resolved else "open"
            raise Conflict(f"the comment is {state} already", current=shape(row).model_dump())
        row.resolved_by, row.resolved_at = (context.who, time.time()) if body.resolved else ("", None)
        session.add(row)
        what = "resolved" if body.resolved else "opened again"
        _note(context, session, row, "resolve" if body.resolved else "reopen", f"{what}: {row.text}", {"comment": row.id})
        stored = shape(row)
    _tell(context, project_id)
    return stored


def _note(context: Context, session: Session, row: Comment, action: str, text: str, after: dict[str, Any]) -> None:
    event = Event(project_id=row.project_id, scope=SCOPE, action=action, text=text, who=context.who, at=time.time())
    event.object_id, event.frame, event.after = row.object_id, row.frame, after
    session.add(event)


def _tell(context: Context, project_id: str) -> None:
    context.hub.publish("comments", project_id)
    projects.tell(context, project_id)


def shape(row: Comment) -> schemas.Comment:
    """A comment as an API schema."""
    return schemas.Comment.model_validate({**row.model_dump(exclude={"project_id", "object_id"}), "object": row.object_id})
