"""Webhook deliveries stored in the transaction of the change: at-least-once, and never for a rolled-back change."""

import json
import time
from typing import Any

from sqlalchemy import inspect
from sqlmodel import Session, col, or_, select

from app.db.tables import Account, Delivery, Job, Project, Webhook

ANNOUNCED = "announced"  # in the info of a session that stores a delivery
ENDED = ("done", "failed", "cancelled")


def announce(session: Session, _context: Any, _instances: Any) -> None:
    """Before a flush, add a delivery to each webhook of a project whose run ended or whose state changed."""
    for row in tuple(session.dirty):
        if isinstance(row, Job) and row.kind == "run" and row.state in ENDED and _changed(row, "state"):
            _deliver(session, row.project_id, "run.finished", {"job": row.id, "state": row.state})
        elif isinstance(row, Project) and _changed(row, "review_state"):
            _deliver(session, row.id, "state.changed", {"state": row.review_state})


def _changed(row: Any, column: str) -> bool:
    return bool(inspect(row).attrs[column].history.has_changes())


def _deliver(session: Session, project_id: str, what: str, facts: dict[str, Any]) -> None:
    with session.no_autoflush:
        project = session.get_one(Project, project_id)
        an_admins = or_(col(Account.id).is_(None), Account.role == "admin")
        hooks = select(Webhook).join(Account, isouter=True)
        found = session.exec(hooks.where(or_(Webhook.project_id == project_id, col(Webhook.project_id).is_(None) & an_admins)))
        for hook in found.all():
            now = time.time()
            said = {"event": what, "project": project_id, "name": project.name, **facts, "at": now}
            body = json.dumps(said, separators=(",", ":"))
            session.add(Delivery(webhook_id=hook.id or 0, event=what, body=body, created=now, due=now))
            session.info[ANNOUNCED] = True
