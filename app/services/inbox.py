"""A user's inbox over all visible projects."""

import re
from typing import Any

from sqlalchemy import func
from sqlmodel import Session, col, select

from app import schemas
from app.db.engine import reading
from app.db.tables import Account, Comment, Event, Project, SceneObject
from app.services import comments, states
from app.services.context import Context


def inbox(context: Context) -> schemas.Inbox:
    """Projects and objects assigned to the user, and open comments that mention them; empty without an account."""
    if not context.person.account:
        return schemas.Inbox(returned=[], assigned=[], objects=[], mentions=[])
    with reading(context.engine) as session:
        me = session.exec(select(Account.id).where(Account.name == context.who)).first()
        shown = col(Project.id).not_in(context.access.hidden(context.person)) & col(Project.archived).is_(False)
        returned: list[schemas.InboxProject] = []
        assigned: list[schemas.InboxProject] = []
        for project, steps in _in_work(session, shown):
            sent_back = project.review_state == "changes requested"
            senders = [step.who for step in steps if step.action == "ready"]
            if project.assignee_id == me:
                (returned if sent_back else assigned).append(_shape(project, steps))
            elif sent_back and project.assignee_id is None and senders[-1:] == [context.who]:
                returned.append(_shape(project, steps))
        return schemas.Inbox(
            returned=returned,
            assigned=assigned,
            objects=_objects(context, session, shown),
            mentions=_mentions(context, session, shown),
        )


def names(name: str, text: str) -> bool:
    """Whether the text mentions that user as `@ann`, not as part of a longer name."""
    return re.search(rf"(?<![\w.@+-])@{re.escape(name)}(?![\w@+-]|\.\w)", text, re.IGNORECASE) is not None


def _in_work(session: Session, shown: Any) -> list[tuple[Project, list[Event]]]:
    """Unapproved projects, least recently changed first, with their state events, oldest first."""
    projects = session.exec(
        select(Project).where(shown, Project.review_state != "approved").order_by(col(Project.updated))
    ).all()
    taken: dict[str, list[Event]] = {project.id: [] for project in projects}
    steps = select(Event).where(Event.scope == states.SCOPE, col(Event.project_id).in_(taken)).order_by(col(Event.id))
    for event in session.exec(steps):
        taken[event.project_id].append(event)
    return [(project, taken[project.id]) for project in projects]


def _shape(project: Project, steps: list[Event]) -> schemas.InboxProject:
    last = steps[-1] if steps else None
    return schemas.InboxProject(
        id=project.id,
        name=project.name,
        review_state=project.review_state,  # type: ignore[arg-type]  # the column has no other values
        who=last.who if last else "",
        at=last.at if last else project.updated,
        reason=str((last.after or {}).get("reason", "")) if last else "",
    )


def _objects(context: Context, session: Session, shown: Any) -> list[schemas.InboxObject]:
    """The user's objects in unapproved projects, least recently changed project first."""
    mine = (col(SceneObject.assignee) == context.who, col(SceneObject.deleted).is_(False))
    query = select(SceneObject, Project).join(Project).where(shown, *mine, Project.review_state != "approved")
    found = session.exec(query.order_by(col(Project.updated), col(Project.id), col(SceneObject.id))).all()
    changed = select(Event.object_id, func.max(Event.at)).where(col(Event.object_id).in_([item.id for item, _ in found]))
    at = dict(session.exec(changed.group_by(col(Event.object_id))).all())
    return [
        schemas.InboxObject(
            project=project.id,
            project_name=project.name,
            review_state=project.review_state,  # type: ignore[arg-type]  # the column has no other values
            object=item.id or 0,
            name=item.name,
            category=item.category,
            at=at.get(item.id, project.updated),
        )
        for item, project in found
    ]


def _mentions(context: Context, session: Session, shown: Any) -> list[schemas.InboxMention]:
    """Open comments that mention the user, newest first."""
    open_ones = col(Comment.resolved_at).is_(None) & (col(Comment.who) != context.who)
    query = select(Comment, Project).join(Project).where(shown, open_ones, col(Comment.text).icontains(f"@{context.who}"))
    return [
        schemas.InboxMention(project=project.id, project_name=project.name, comment=comments.shape(row))
        for row, project in session.exec(query.order_by(col(Comment.id).desc()))
        if names(context.who, row.text)
    ]
