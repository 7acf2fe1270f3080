"""Assignment of projects and objects to users, and the names available for it."""

import time

from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Account, Event
from app.services import accounts, projects
from app.services.context import Context
from r2c2r_core.errors import InputError


def names(context: Context, project_id: str) -> list[str]:
    """Names of all accounts that may see the project."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        return _names(context, session, project_id)


def require_name(context: Context, session: Session, project_id: str, name: str) -> str:
    """The account's name; InputError for a user who may not see the project."""
    if name.lower() not in _names(context, session, project_id):
        hint = "choose a name of the list, or make them a member"
        raise InputError(f"nobody called {name.lower()} sees this project", hint=hint)
    return name.lower()


def assign(context: Context, project_id: str, body: schemas.AssigneeIn) -> schemas.Project:
    """Assign the project to a user, or to none; InputError for a user who may not see it."""
    with writing(context.engine) as session:
        row = queries.project_row(session, project_id)
        name = require_name(context, session, project_id, body.name) if body.name else None
        before = queries.account_name(session, row.assignee_id)
        if name != before:
            row.assignee_id, row.updated = accounts.row(session, name).id if name else None, time.time()
            text = f"assigned to {name}" if name else "assigned to nobody"
            event = Event(project_id=row.id, scope="project", action="assign", text=text, who=context.who, at=row.updated)
            event.before, event.after = {"assignee": before}, {"assignee": name}
            session.add_all([row, event])
    projects.tell(context, project_id)
    return projects.get_project(context, project_id)


def _names(context: Context, session: Session, project_id: str) -> list[str]:
    found = session.exec(select(Account).order_by(col(Account.name))).all()
    return [account.name for account in found if context.access.sees(accounts.person(account), project_id)]
