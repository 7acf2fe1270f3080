"""Keys in printed addresses: whoever opens one first is whoever started the server, and it opens nothing after that.

Each server forgets those of the ones before it. `r2c2r key` prints another while the server runs: who may write its database
may as well sign in.
"""

import hashlib
import secrets
import time

from sqlalchemy import Engine
from sqlmodel import Session, delete

from app.db.engine import writing
from app.db.tables import LaunchKey


def forget(engine: Engine) -> None:
    """Drop earlier servers' keys; before the new one says where it is, for a key that is made from then on opens it."""
    with writing(engine) as session:
        session.exec(delete(LaunchKey))


def keep(engine: Engine, key: str) -> None:
    """Store the first key of a server, which it prints."""
    with writing(engine) as session:
        _store(session, key)


def new(engine: Engine) -> str:
    """One more key."""
    key = secrets.token_urlsafe(24)
    with writing(engine) as session:
        _store(session, key)
    return key


def use(session: Session, key: str) -> bool:
    """Whether the key opens: only once, for it goes with the transaction."""
    found = session.get(LaunchKey, _digest(key))
    if found is not None:
        session.delete(found)
    return found is not None


def _store(session: Session, key: str) -> None:
    session.merge(LaunchKey(digest=_digest(key), created=time.time()))


def _digest(key: str) -> str:
    return hashlib.sha256(key.encode("utf-8", "surrogatepass")).hexdigest()
