"""A change that is sent again, because its answer got lost on the way, is not made again.

The sender marks a change with a key of its own. The key is stored in the transaction that makes the change, the answer right
after it; both are kept as long as a browser's session, for a tab may come back with what it could not send. A server that
dies between the two has the key without the answer: the change was made.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, cast

from sqlalchemy import CursorResult, insert, update
from sqlmodel import Session, col, delete

from app.db.tables import SentChange
from app.errors import Conflict

KEPT_S = 30 * 24 * 3600.0


@dataclass(frozen=True, slots=True)
class Sending:
    """A marked change on its way: who sent it under which key (a digest), and what it asks for."""

    digest: str
    request: str  # method and path
    project_id: str | None


_sending: ContextVar[Sending | None] = ContextVar("sending", default=None)


@contextmanager
def marked(sending: Sending) -> Iterator[None]:
    """What is written inside belongs to the marked change."""
    token = _sending.set(sending)
    try:
        yield
    finally:
        _sending.reset(token)


def claim(session: Session) -> None:
    """Store the key with what this transaction changes; nothing outside a marked change.

    Raises Conflict for a key that is stored: whatever happened to the first one, a second one changes nothing.
    """
    sending = _sending.get()
    if sending is not None:
        row = SentChange(digest=sending.digest, request=sending.request, project_id=sending.project_id, at=time.time())
        stored = session.execute(insert(SentChange).prefix_with("OR IGNORE").values(**row.model_dump()))
        if not cast(CursorResult[Any], stored).rowcount:
            raise Conflict("this change is stored already", hint="look at what is there now")


def find(session: Session, digest: str) -> SentChange | None:
    """What became of the change with that key."""
    return session.get(SentChange, digest)


def answered(session: Session, digest: str, status: int, body: str) -> None:
    """Keep the answer beside the key, if the change was stored at all."""
    session.exec(update(SentChange).where(col(SentChange.digest) == digest).values(status=status, answer=body))


def forget(session: Session, *, before: float | None = None, project_id: str | None = None) -> None:
    """Delete what is older, or what was about a project."""
    if before is not None:
        session.exec(delete(SentChange).where(col(SentChange.at) < before))
    if project_id is not None:
        session.exec(delete(SentChange).where(col(SentChange.project_id) == project_id))
