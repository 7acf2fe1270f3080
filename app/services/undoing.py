"""Undo and redo: of clicks and names for all users, of verdicts and corrections for reviewers."""

from typing import Literal

from sqlmodel import Session

from app import schemas
from app.db import history, once, queries
from app.db.engine import writing
from app.db.tables import Project, SceneObject
from app.errors import Conflict
from app.services import prompts, reviews
from app.services.context import Context


def undo(context: Context, project_id: str, body: schemas.UndoRequest) -> schemas.Undone:
    """Undo the last change of one object, or this person's last one in the project."""
    return _step(context, project_id, body, "undo")


def redo(context: Context, project_id: str, body: schemas.UndoRequest) -> schemas.Undone:
    """Redo what was undone last."""
    return _step(context, project_id, body, "redo")


def _step(context: Context, project_id: str, body: schemas.UndoRequest, direction: Literal["undo", "redo"]) -> schemas.Undone:
    if body.scope == "review":
        context.require("reviewer")
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        number = body.object
        if number is None:
            number = history.last_change(session, project_id, body.scope, direction, context.who)
        if number is None:
            raise Conflict(f"you have nothing to {direction} here")
        item = queries.object_row(session, project_id, number, deleted=True)
        _refuse_overtaken(context, session, project, item, body)
        step = history.undo if direction == "undo" else history.redo
        event = step(session, item, body.scope, who=context.who)
        version = item.version if body.scope == "prompts" else history.version_of(session, item, "review")
        change = prompts.change_of(context, session, project, item, infer=body.scope == "prompts")
        undone = schemas.Undone(object=change.shape, text=event.text, frame=event.frame, version=version)
        once.keep_answer(session, undone.model_dump_json())
    if "assignee" in (event.before or {}):
        context.hub.publish("projects", None)  # inbox counts are updated
    shape = prompts.after_change(context, change)
    if body.scope == "review":
        context.hub.publish("review", project_id, object=number)
    return undone.model_copy(update={"object": shape})


def _refuse_overtaken(
    context: Context, session: Session, project: Project, item: SceneObject, body: schemas.UndoRequest
) -> None:
    """Raise Conflict instead of undoing a change that the sender has not seen."""
    if body.scope == "review":
        reviews.refuse_overtaken(context, session, project, item, body)
    else:
        prompts.refuse_overtaken(context, session, project, item, body)
