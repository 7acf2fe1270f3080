"""Webhook management by users: of their own projects, and of all projects for admins."""

import json
import secrets
import time
from typing import Any

from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Account, Delivery, Project, Webhook
from app.errors import Forbidden, NotFound
from app.services import audit
from app.services.context import Context
from r2c2r_core.errors import InputError

MOST = 100  # on a server
SHOWN = 100  # newest deliveries of one webhook


def listed(context: Context) -> list[schemas.Webhook]:
    """The user's webhooks; for an admin, everyone's."""
    with reading(context.engine) as session:
        return [_shape(session, *found) for found in session.exec(_mine(context).order_by(col(Webhook.id)))]


def add(context: Context, body: schemas.WebhookIn) -> schemas.NewWebhook:
    """Add a webhook for a project, or, as an admin, for all projects."""
    if body.project is None:
        context.require("admin")
    with writing(context.engine) as session:
        _check_project(context, session, body.project)
        if len(session.exec(select(Webhook.id)).all()) >= MOST:
            raise InputError(f"there are already {MOST} webhooks", hint="remove unused ones")
        account = session.exec(select(Account).where(Account.name == context.who)).first() if context.person.account else None
        row = Webhook(project_id=body.project, url=body.url, secret=secrets.token_urlsafe(32), created=time.time())
        row.account_id = account.id if account else None
        session.add(row)
        session.flush()
        audit.note(session, "webhook made", account=account.name if account else "", who=context.who, detail=body.url)
        project = session.get(Project, body.project) if body.project is not None else None
        return schemas.NewWebhook(**_shape(session, row, account, project).model_dump(), secret=row.secret)


def remove(context: Context, number: int) -> None:
    """Remove a webhook and its pending deliveries."""
    with writing(context.engine) as session:
        row, account, _ = _found(context, session, number)
        session.delete(row)
        audit.note(session, "webhook removed", account=account.name if account else "", who=context.who, detail=row.url)


def test(context: Context, number: int) -> schemas.Delivery:
    """Send a test message once."""
    with writing(context.engine) as session:
        row, _, project = _found(context, session, number)
        now = time.time()
        said = {"event": "test", "project": row.project_id, "name": project.name if project else "", "at": now}
        body = json.dumps(said, separators=(",", ":"))
        made = Delivery(webhook_id=number, event="test", body=body, created=now, due=now)
        session.add(made)
        session.flush()
        shape = _delivery(made)
    context.posting.wake()
    return shape


def deliveries(context: Context, number: int) -> list[schemas.Delivery]:
    """Past and pending deliveries of a webhook, newest first."""
    with reading(context.engine) as session:
        _found(context, session, number)
        query = select(Delivery).where(Delivery.webhook_id == number).order_by(col(Delivery.id).desc()).limit(SHOWN)
        return [_delivery(row) for row in session.exec(query)]


def _check_project(context: Context, session: Session, project_id: str | None) -> None:
    if project_id is None or context.person.may("admin"):
        if project_id is not None:
            queries.project_row(session, project_id)
        return
    if not context.access.sees(context.person, project_id):
        raise NotFound("there is no such project", hint="it may have been deleted")
    if not context.person.account or queries.owner(session, queries.project_row(session, project_id)) != context.who:
        raise Forbidden("only the project's owner or an admin may add a webhook for it", hint="ask one of them")


def _mine(context: Context) -> Any:
    query = select(Webhook, Account, Project).select_from(Webhook)
    query = query.join(Account, col(Account.id) == Webhook.account_id, isouter=True)
    query = query.join(Project, col(Project.id) == Webhook.project_id, isouter=True)
    return query if context.person.may("admin") else query.where(Account.name == context.who)


def _found(context: Context, session: Session, number: int) -> tuple[Webhook, Account | None, Project | None]:
    found: tuple[Webhook, Account | None, Project | None] | None = session.exec(
        _mine(context).where(Webhook.id == number)
    ).first()
    if found is None:
        raise NotFound(f"no webhook {number}")
    return found


def _delivery(row: Delivery) -> schemas.Delivery:
    return schemas.Delivery(**row.model_dump(exclude={"webhook_id"}))


def _shape(session: Session, row: Webhook, account: Account | None, project: Project | None) -> schemas.Webhook:
    of = select(Delivery).where(Delivery.webhook_id == row.id)
    last = session.exec(of.where(Delivery.attempts > 0).order_by(col(Delivery.id).desc())).first()
    delivered = session.exec(of.where(col(Delivery.delivered).is_not(None)).order_by(col(Delivery.id).desc())).first()
    return schemas.Webhook(
        id=row.id or 0,
        url=row.url,
        project=row.project_id,
        project_name=project.name if project else "",
        owner=account.name if account else "",
        created=row.created,
        answer=last.answer if last else "",
        delivered=delivered.delivered if delivered else None,
    )
