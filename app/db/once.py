"""Idempotent changes: a request that is repeated because its answer was lost is not applied again.

The sender marks a change with an idempotency key. The key is stored in the transaction that makes the change, and so is the
answer if it is known by then; else right after it. Both are kept as long as a browser's session, as a tab may return with
unsent changes. If a server dies before the answer is stored, the key alone shows that the change was made.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from sqlalchemy import bindparam, text, update
from sqlmodel import Session, col, delete

from app.db.tables import SentChange
from app.errors import Conflict

KEPT_S = 30 * 24 * 3600.0


@dataclass(frozen=True, slots=True)
class Answer:
    """The stored first answer."""

    status: int
    body: str


@dataclass(slots=True)
class Sending:
    """A marked change in progress: digest of sender and key, and the request."""

    digest: str
    request: str  # method and path
    project_id: str | None
    status: int = 200  # of the answer on success, from its route
    kept: Answer | None = field(default=None, compare=False)  # stored with the change


_CLAIM = text(
    "INSERT INTO sent_changes (digest, request, project_id, at, answer) "
    "VALUES (:digest, :request, :project_id, :at, :answer) ON CONFLICT DO NOTHING"
)
_ANSWERED = (
    update(SentChange)
    .where(col(SentChange.digest) == bindparam("claimed"))
    .values(status=bindparam("status"), answer=bindparam("answer"))
)
_sending: ContextVar[Sending | None] = ContextVar("sending", default=None)


@contextmanager
def marked(sending: Sending) -> Iterator[None]:
    """Context whose writes belong to the marked change."""
    token = _sending.set(sending)
    try:
        yield
    finally:
        _sending.reset(token)


def promise(status: int) -> None:
    """Set the status with which the current route answers on success."""
    if (sending := _sending.get()) is not None:
        sending.status = status


def claim(session: Session) -> None:
    """Store the key in this transaction; no-op outside a marked change.

    Raises Conflict for a stored key: whatever the outcome of the first request, a second one changes nothing.
    """
    sending = _sending.get()
    if sending is not None:
        row = {"digest": sending.digest, "request": sending.request, "project_id": sending.project_id, "at": time.time()}
        if not session.connection().execute(_CLAIM, {**row, "answer": ""}).rowcount:
            raise Conflict("this change is stored already", hint="check the current state")


def keep_answer(session: Session, body: str) -> None:
    """Store the answer in the transaction that makes the change; no-op outside a marked change."""
    sending = _sending.get()
    if sending is not None:
        answered(session, sending.digest, sending.status, body)
        sending.kept = Answer(sending.status, body)


def find(session: Session, digest: str) -> SentChange | None:
    """The stored change with that key, or None."""
    return session.get(SentChange, digest)


def answered(session: Session, digest: str, status: int, body: str) -> None:
    """Store the answer with the key, if the change was stored."""
    session.connection().execute(_ANSWERED, {"claimed": digest, "status": status, "answer": body})


def forget(session: Session, *, before: float | None = None, project_id: str | None = None) -> None:
    """Delete older entries, or those of a project."""
    if before is not None:
        session.exec(delete(SentChange).where(col(SentChange.at) < before))
    if project_id is not None:
        session.exec(delete(SentChange).where(col(SentChange.project_id) == project_id))
