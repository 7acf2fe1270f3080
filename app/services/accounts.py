"""Named accounts: who may sign in, as what, with which password. Each change is in the record, with who made it."""

import re
import time
from functools import cache
from typing import Any

from sqlalchemy import Engine
from sqlmodel import Session, col, delete, select

from app.db.engine import reading, writing
from app.db.tables import Account, SignIn
from app.errors import Conflict, NotFound
from app.security import ROLES, Person, Role
from app.services import audit, passwords
from r2c2r_core.errors import InputError

_NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,39}")


def add(engine: Engine, name: str, role: str, password: str, *, by: str = audit.COMMAND_LINE) -> None:
    """A new account; raises Conflict when the name is taken."""
    name = name.lower()
    if not _NAME.fullmatch(name):
        raise InputError(f"{name!r} is no name for an account", hint="letters, digits, dot, dash, underscore; at most 40")
    passwords.refuse_weak(name, password)
    account = Account(name=name, role=_role(role), password=_hashed(password), created=time.time())
    with writing(engine) as session:
        if session.exec(select(Account).where(Account.name == name)).first() is not None:
            raise Conflict(f"there is an account {name} already", hint="r2c2r user role, or r2c2r user password")
        session.add(account)
        audit.note(session, "added", account=name, who=by, detail=account.role)


def everyone(engine: Engine) -> list[Person]:
    """All accounts by name."""
    with reading(engine) as session:
        return [person(account) for account in session.exec(select(Account).order_by(col(Account.name)))]


def remove(engine: Engine, name: str, *, by: str = audit.COMMAND_LINE) -> None:
    """Delete the account and end its sessions; what the person did keeps the name. Raises Conflict for the last admin."""
    with writing(engine) as session:
        account = row(session, name)
        _refuse_last_admin(session, account)
        session.delete(account)
        audit.note(session, "removed", account=account.name, who=by, detail=account.role)


def change(
    engine: Engine, name: str, *, role: str | None = None, password: str | None = None, by: str = audit.COMMAND_LINE
) -> None:
    """Another role, from now on; another password, which ends the account's sessions. Both or neither.

    Raises Conflict for the role of the last admin.
    """
    wanted = _role(role) if role is not None else None
    if password is not None:
        passwords.refuse_weak(name, password)
    digest = _hashed(password) if password is not None else None
    with writing(engine) as session:
        account = row(session, name)
        if wanted is not None and wanted != account.role:
            _refuse_last_admin(session, account)
            audit.note(session, "role", account=account.name, who=by, detail=f"{account.role} → {wanted}")
            account.role = wanted
        if digest is not None:
            account.password = digest
            session.exec(delete(SignIn).where(col(SignIn.account_id) == account.id))
            audit.note(session, "password", account=account.name, who=by)
        session.add(account)


def verified(engine: Engine, name: str, password: str) -> Account | None:
    """The account, when the password is its own; an unknown name takes as long as a wrong password.

    It takes 64 MiB and a third of a second of processor time: call it behind the gate of passwords.
    """
    from argon2.exceptions import InvalidHashError, VerificationError

    with reading(engine) as session:
        account = session.exec(select(Account).where(Account.name == name.lower())).first()
    try:
        _hasher().verify(account.password if account else _nobodys_password(), password[: passwords.LONGEST])
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


def _refuse_last_admin(session: Session, account: Account) -> None:
    """Somebody may always let people in; asked in the transaction of the change, so that two at once do not both pass."""
    admins = session.exec(select(Account.name).where(Account.role == "admin")).all()
    if admins == [account.name]:
        raise Conflict(f"{account.name} is the only admin", hint="make somebody else admin first")


def _role(role: str) -> Role:
    for known in ROLES:
        if role == known:
            return known
    raise InputError(f"{role!r} is no role", hint=f"one of {', '.join(ROLES)}")


def _hashed(password: str) -> str:
    return str(_hasher().hash(password))


@cache
def _nobodys_password() -> str:
    return _hashed("nobody knows this one")


@cache
def _hasher() -> Any:
    from argon2 import PasswordHasher  # only where there are accounts

    return PasswordHasher(parallelism=1)
