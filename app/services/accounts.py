"""Named accounts: who may sign in, as what, with which password."""

import re
import threading
import time
from functools import cache
from typing import Any

from sqlalchemy import Engine
from sqlmodel import Session, col, delete, select

from app.db.engine import reading, writing
from app.db.tables import Account, SignIn
from app.errors import Conflict, NotFound
from app.security import ROLES, Person, Role
from r2c2r_core.errors import InputError

SHORTEST_PASSWORD = 10
LONGEST_PASSWORD = 1000
_NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,39}")
_hashing = threading.BoundedSemaphore(2)  # each takes 64 MiB for a moment


def add(engine: Engine, name: str, role: str, password: str) -> None:
    """A new account; raises Conflict when the name is taken."""
    name = name.lower()
    if not _NAME.fullmatch(name):
        raise InputError(f"{name!r} is no name for an account", hint="letters, digits, dot, dash, underscore; at most 40")
    account = Account(name=name, role=_role(role), password=_hashed(password), created=time.time())
    with writing(engine) as session:
        if session.exec(select(Account).where(Account.name == name)).first() is not None:
            raise Conflict(f"there is an account {name} already", hint="r2c2r user role, or r2c2r user password")
        session.add(account)


def everyone(engine: Engine) -> list[Person]:
    """All accounts by name."""
    with reading(engine) as session:
        return [person(account) for account in session.exec(select(Account).order_by(col(Account.name)))]


def remove(engine: Engine, name: str) -> None:
    """Delete the account and end its sessions; what the person did keeps the name."""
    with writing(engine) as session:
        session.delete(row(session, name))


def set_role(engine: Engine, name: str, role: str) -> None:
    """What the person may do from now on."""
    with writing(engine) as session:
        account = row(session, name)
        account.role = _role(role)
        session.add(account)


def set_password(engine: Engine, name: str, password: str) -> None:
    """A new password; the account's sessions end."""
    digest = _hashed(password)
    with writing(engine) as session:
        account = row(session, name)
        account.password = digest
        session.add(account)
        session.exec(delete(SignIn).where(col(SignIn.account_id) == account.id))


def verified(engine: Engine, name: str, password: str) -> Account | None:
    """The account, when the password is its own; an unknown name takes as long as a wrong password."""
    from argon2.exceptions import InvalidHashError, VerificationError

    with reading(engine) as session:
        account = session.exec(select(Account).where(Account.name == name.lower())).first()
    try:
        with _hashing:
            _hasher().verify(account.password if account else _nobodys_password(), password[:LONGEST_PASSWORD])
    except (VerificationError, InvalidHashError):
        return None
    return account


def person(account: Account) -> Person:
    """The person behind an account."""
    role: Any = account.role  # the column holds no other
    return Person(account.name, role, account=True)


def row(session: Session, name: str) -> Account:
    """The account of that name; raises NotFound."""
    found = session.exec(select(Account).where(Account.name == name.lower())).first()
    if found is None:
        raise NotFound(f"no account {name}", hint="r2c2r user list")
    return found


def _role(role: str) -> Role:
    for known in ROLES:
        if role == known:
            return known
    raise InputError(f"{role!r} is no role", hint=f"one of {', '.join(ROLES)}")


def _hashed(password: str) -> str:
    if not SHORTEST_PASSWORD <= len(password) <= LONGEST_PASSWORD:
        raise InputError(
            f"the password has {len(password)} characters", hint=f"at least {SHORTEST_PASSWORD}, such as three words"
        )
    with _hashing:
        return str(_hasher().hash(password))


@cache
def _nobodys_password() -> str:
    return _hashed("nobody knows this one")


@cache
def _hasher() -> Any:
    from argon2 import PasswordHasher  # only where there are accounts

    return PasswordHasher(parallelism=1)
