"""Changes of a project by others since a user last marked them as read, or made a change there."""

import time
from collections import Counter
from typing import Any

from sqlalchemy import func
from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Event, Seen
from app.services import imports, projects
from app.services.context import Context

SHOWN = 50  # maximum entries; counts per user include all


def news(context: Context, project_id: str) -> schemas.News:
    """News of the current user; empty without an account, and before the first `mark_seen`."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        last = session.exec(select(func.max(Event.id)).where(Event.project_id == project_id)).one() or 0
        read = _read(context, session, project_id)
        if read is None:
            return schemas.News(since=None, last=last, people=[], entries=[])
        event, since = read
        new: Any = (Event.project_id == project_id, col(Event.id) > event, Event.who != context.who)
        people = Counter(dict(session.exec(select(Event.who, func.count()).where(*new).group_by(col(Event.who))).all()))
        rows = session.exec(select(Event).where(*new).order_by(col(Event.id).desc()).limit(SHOWN).options(*projects.UNSHOWN))
        return schemas.News(
            since=since,
            last=last,
            people=[schemas.PersonsChanges(who=who, changes=count) for who, count in people.most_common()],
            entries=[projects.history_entry(row) for row in rows],
        )


def mark_seen(context: Context, project_id: str, body: schemas.SeenIn) -> schemas.News:
    """Mark the news up to an event as read; an earlier event has no effect."""
    with writing(context.engine) as session:
        queries.project_row(session, project_id)
        account = imports.account_of(context, session)
        if account is not None:
            row = session.get(Seen, (project_id, account)) or Seen(project_id=project_id, account_id=account, event=0, at=0.0)
            row.event, row.at = max(row.event, body.event), time.time()
            session.add(row)
    return news(context, project_id)


def _read(context: Context, session: Session, project_id: str) -> tuple[int, float] | None:
    """The last event known to the user, and its time."""
    account = imports.account_of(context, session)
    if account is None:
        return None
    row = session.get(Seen, (project_id, account))
    own = select(Event.id, Event.at).where(Event.project_id == project_id, Event.who == context.who)
    mine = session.exec(own.order_by(col(Event.id).desc())).first()
    known = [(row.event, row.at)] if row else []
    return max([*known, *([(mine[0] or 0, mine[1])] if mine else [])], default=None)
