"""Members of a project."""

import time

from sqlmodel import Session, col, delete, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Account, Event, Project, ProjectMember
from app.errors import Forbidden
from app.services import crossing, projects
from app.services.context import Context
from r2c2r_core.errors import InputError


def members(context: Context, project_id: str) -> schemas.ProjectMembers:
    """Users who may see the project."""
    with reading(context.engine) as session:
        row = queries.project_row(session, project_id)
        owner, may_change = queries.owner(session, row), _may_change(context, session, row)
        everybody = session.exec(select(Account.name).order_by(col(Account.name))).all() if may_change else []
        return schemas.ProjectMembers(
            members_only=row.members_only,
            owner=owner,
            members=sorted(queries.who_sees(session, row) - {owner}),
            may_change=may_change,
            accounts=[name for name in everybody if name != owner],
        )


def set_members(context: Context, project_id: str, body: schemas.MembersIn) -> schemas.ProjectMembers:
    """Make the project visible to all, or only to these members; by its owner or an admin."""
    with writing(context.engine) as session:
        row = queries.project_row(session, project_id)
        if not _may_change(context, session, row):
            raise Forbidden("only the project's owner or an admin may choose its members", hint="ask one of them")
        accounts = session.exec(select(Account).where(col(Account.name).in_({name.lower() for name in body.members}))).all()
        unknown = {name.lower() for name in body.members} - {account.name for account in accounts}
        if unknown:
            raise InputError(f"there is no account {sorted(unknown)[0]}", hint="choose names of the page People")
        session.exec(delete(ProjectMember).where(col(ProjectMember.project_id) == project_id))
        session.add_all(ProjectMember(project_id=project_id, account_id=account.id or 0) for account in accounts)
        names = ", ".join(sorted(account.name for account in accounts))
        text = f"only its owner and {names or 'admins'} see it" if body.members_only else "everybody sees it"
        event = Event(project_id=project_id, scope="project", action="members", text=text, who=context.who, at=time.time())
        row.members_only, row.updated = body.members_only, event.at
        session.add_all([row, event])
    crossing.sees_changed(context)
    crossing.show_out(context, project_id, "is kept to its members now")
    projects.tell(context, project_id)
    return members(context, project_id)


def _may_change(context: Context, session: Session, row: Project) -> bool:
    return context.person.may("admin") or (context.person.account and queries.owner(session, row) == context.who)
