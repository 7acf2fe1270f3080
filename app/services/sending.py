"""Idempotent changes with a sender's key: applied once, with a stored answer to repeated requests."""

import hashlib
import time
from urllib.parse import unquote

from app.db import once
from app.db.engine import reading, writing
from app.db.once import Answer, Sending, marked, promise
from app.errors import Conflict, Unauthorised
from app.security import Person
from app.services.context import Context
from r2c2r_core.errors import InputError

__all__ = ["Answer", "Sending", "answer_of", "keep", "marked", "promise", "sending", "tidy"]

LONGEST_KEY = 100


def sending(person: Person, key: str, method: str, path: str) -> Sending:
    """The marked change; keys of different users cannot collide."""
    if not 1 <= len(key) <= LONGEST_KEY:
        raise InputError(f"Idempotency-Key has {len(key)} characters", hint=f"between 1 and {LONGEST_KEY}")
    parts = path.split("/")  # /api/projects/PROJECT/…
    project = parts[3] if parts[2] == "projects" and len(parts) > 4 else None
    return Sending(hashlib.sha256(f"{person.name}\0{key}".encode()).hexdigest(), f"{method} {path}", project)


def check_person(person: Person, named: str | None) -> None:
    """Refuse pending changes of a page whose user differs from the signed-in one; `named` is percent-encoded."""
    if named is not None and unquote(named) != person.name:
        raise Unauthorised(
            f"this change was made by {unquote(named)!r}, but {person.name!r} is signed in now",
            hint="sign in as the person who made it: the change waits until then",
        )


def answer_of(context: Context, change: Sending) -> Answer | None:
    """The stored answer of a change; None if it was not made yet."""
    with reading(context.engine) as session:
        found = once.find(session, change.digest)
    if found is None:
        return None
    if found.request != change.request:
        raise InputError("this Idempotency-Key was used for another change", hint="make a new key for each change")
    if found.status is None:
        raise Conflict("this change is stored; the server stopped before it could confirm that", hint="check the current state")
    return Answer(found.status, found.answer)


def keep(context: Context, change: Sending, answer: Answer) -> None:
    """Store the answer that could not be stored with the change."""
    with writing(context.engine) as session:
        once.answered(session, change.digest, answer.status, answer.body)


def tidy(context: Context) -> None:
    """Delete expired keys."""
    with writing(context.engine) as session:
        once.forget(session, before=time.time() - once.KEPT_S)
