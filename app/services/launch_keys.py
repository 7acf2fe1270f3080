"""One-time keys in printed addresses: the first use signs in as the user who started the server.

Each server deletes keys of earlier ones. `r2c2r key` prints another while the server runs, since write access to its
database implies the right to sign in.
"""

import hashlib
import secrets
import time

from sqlalchemy import Engine
from sqlmodel import Session, delete

from app.db.engine import writing
from app.db.tables import LaunchKey


def forget(engine: Engine) -> None:
    """Delete earlier servers' keys, before the new server publishes its address, as later keys are valid for it."""
    with writing(engine) as session:
        session.exec(delete(LaunchKey))


def keep(engine: Engine, key: str) -> None:
    """Store the server's first, printed key."""
    with writing(engine) as session:
        _store(session, key)


def new(engine: Engine) -> str:
    """Create another key."""
    key = secrets.token_urlsafe(24)
    with writing(engine) as session:
        _store(session, key)
    return key


def use(session: Session, key: str) -> bool:
    """Whether the key is valid; it is deleted in the transaction, so it works only once."""
    found = session.get(LaunchKey, _digest(key))
    if found is not None:
        session.delete(found)
    return found is not None


def _store(session: Session, key: str) -> None:
    session.merge(LaunchKey(digest=_digest(key), created=time.time()))


def _digest(key: str) -> str:
    return hashlib.sha256(key.encode("utf-8", "surrogatepass")).hexdigest()
