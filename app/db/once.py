"""A change that is sent again, because its answer got lost on the way, is not made again.

The sender marks a change with a key of its own. The key is stored in the transaction that makes the change, and so is the
answer where it is known by then; else right after it. Both are kept as long as a browser's session, for a tab may come back
with what it could not send. A server that dies before the answer is stored has the key without it: the change was made.
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
    """What was answered the first time."""

    status: int
    body: str


@dataclass(slots=True)
class Sending:
    """A marked change on its way: who sent it under which key (a digest), and what it asks for."""

    digest: str
    request: str  # method and path
    project_id: str | None
    status: int = 200  # of the answer once it is made, as its route says
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
    """What is written inside belongs to the marked change."""
    token = _sending.set(sending)
    try:
        yield
    finally:
        _sending.reset(token)


def promise(status: int) -> None:
    """The route of what is being asked answers with this status when all goes well."""
    if (sending := _sending.get()) is not None:
        sending.status = status


def claim(session: Session) -> None:
    """Store the key with what this transaction changes; nothing outside a marked change.

    Raises Conflict for a key that is stored: whatever happened to the first one, a second one changes nothing.
    """
    sending = _sending.get()
    if sending is not None:
        row = {"digest": sending.digest, "request": sending.request, "project_id": sending.project_id, "at": time.time()}
        if not session.connection().execute(_CLAIM, {**row, "answer": ""}).rowcount:
            raise Conflict("this change is stored already", hint="look at what is there now")


def keep_answer(session: Session, body: str) -> None:
    """Store what will be answered in the transaction that makes the change; nothing outside a marked one."""
    sending = _sending.get()
    if sending is not None:
        answered(session, sending.digest, sending.status, body)
        sending.kept = Answer(sending.status, body)


def find(session: Session, digest: str) -> SentChange | None:
    """What became of the change with that key."""
    return session.get(SentChange, digest)


def answered(session: Session, digest: str, status: int, body: str) -> None:
    """Keep the answer beside the key, if the change was stored at all."""
    session.connection().execute(_ANSWERED, {"claimed": digest, "status": status, "answer": body})


def forget(session: Session, *, before: float | None = None, project_id: str | None = None) -> None:
    """Delete what is older, or what was about a project."""
    if before is not None:
        session.exec(delete(SentChange).where(col(SentChange.at) < before))
    if project_id is not None:
        session.exec(delete(SentChange).where(col(SentChange.project_id) == project_id))
