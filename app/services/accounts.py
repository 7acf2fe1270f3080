"""Named accounts with roles and passwords. Each change is recorded in the audit log with its author."""

import re
import time
from functools import cache
from typing import Any

from sqlalchemy import Engine, update
from sqlmodel import Session, col, delete, select

from app.db.engine import reading, writing
from app.db.tables import Account, SceneObject, SignIn
from app.errors import Conflict, NotFound
from app.security import ROLES, Person, Role
from app.services import audit, passwords
from r2c2r_core.errors import InputError

_NAME = re.compile(r"[a-z0-9][a-z0-9._@+-]{0,59}")
NO_PASSWORD = ""  # of accounts authenticated by a proxy or provider


def add(engine: Engine, name: str, role: str, password: str, *, by: str = audit.COMMAND_LINE) -> None:
    """Add an account; raises Conflict when the name is taken."""
    name = _checked(name)
    passwords.refuse_weak(name, password)
    account = Account(name=name, role=known_role(role), password=_hashed(password), created=time.time())
    with writing(engine) as session:
        if session.exec(select(Account).where(Account.name == name)).first() is not None:
            raise Conflict(f"the account {name} already exists", hint="r2c2r user role, or r2c2r user password")
        session.add(account)
        audit.note(session, "added", account=name, who=by, detail=account.role)


def seen(session: Session, name: str, role: str, *, by: str) -> Account:
    """The account of that name, created without a password on first use. Raises InputError."""
    name = _checked(name)
    found = session.exec(select(Account).where(Account.name == name)).first()
    if found is not None:
        return found
    account = Account(name=name, role=known_role(role), password=NO_PASSWORD, created=time.time())
    session.add(account)
    session.flush()
    audit.note(session, "added", account=name, who=by, detail=account.role)
    return account


def of_subject(session: Session, subject: str, name: str, role: str | None, default: str, *, by: str) -> Account:
    """The account of an OpenID subject, with the provider's role, if any; created on first use.

    Raises Conflict for another account's name, so that choosing a name at the provider gives no access to it.
    """
    found = session.exec(select(Account).where(Account.subject == subject)).first()
    if found is None:
        if session.exec(select(Account).where(Account.name == name.lower())).first() is not None:
            hint = f"an admin removes that one first, r2c2r user remove {name}: what it did stays under the name"
            raise Conflict(f"the account {name} belongs to somebody else", hint=hint)
        found = seen(session, name, role or default, by=by)
        found.subject = subject
    elif role is not None and role != found.role:
        audit.note(session, "role", account=found.name, who=by, detail=f"{found.role} → {role}")
        found.role = known_role(role)
    session.add(found)
    return found


def everyone(engine: Engine) -> list[Person]:
    """All accounts by name."""
    with reading(engine) as session:
        return [person(account) for account in session.exec(select(Account).order_by(col(Account.name)))]


def remove(engine: Engine, name: str, *, by: str = audit.COMMAND_LINE) -> None:
    """Delete the account and end its sessions; the history keeps the name. Raises Conflict for the last admin."""
    with writing(engine) as session:
        account = row(session, name)
        _refuse_last_admin(session, account)
        session.exec(update(SceneObject).where(col(SceneObject.assignee) == account.name).values(assignee=None))
        session.delete(account)
        audit.note(session, "removed", account=account.name, who=by, detail=account.role)


def change(
    engine: Engine, name: str, *, role: str | None = None, password: str | None = None, by: str = audit.COMMAND_LINE
) -> None:
    """Change role and password, the latter ending the account's sessions, both or neither.

    Raises Conflict for the role of the last admin.
    """
    wanted = known_role(role) if role is not None else None
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
    """The account if the password is correct; an unknown name takes as long as a wrong password.

    It takes 64 MiB and a third of a second of processor time: call it behind the password gate.
    """
    from argon2.exceptions import InvalidHashError, VerificationError

    with reading(engine) as session:
        account = session.exec(select(Account).where(Account.name == name.lower())).first()
    try:
        stored = account.password if account else NO_PASSWORD
        _hasher().verify(stored or _nobodys_password(), password[: passwords.LONGEST])
    except (VerificationError, InvalidHashError):
        return None
    return account if stored else None


def person(account: Account) -> Person:
    """The Person of an account."""
    role: Any = account.role  # the column has no other values
    return Person(account.name, role, account=True)


def row(session: Session, name: str) -> Account:
    """The account of that name; raises NotFound."""
    found = session.exec(select(Account).where(Account.name == name.lower())).first()
    if found is None:
        raise NotFound(f"no account {name}", hint="r2c2r user list")
    return found


def _refuse_last_admin(session: Session, account: Account) -> None:
    """Raise Conflict for the last admin, checked in the transaction of the change, so that two concurrent ones cannot pass."""
    admins = session.exec(select(Account.name).where(Account.role == "admin")).all()
    if admins == [account.name]:
        raise Conflict(f"{account.name} is the only admin", hint="make another account admin first")


def _checked(name: str) -> str:
    name = name.lower()
    if not _NAME.fullmatch(name):
        raise InputError(f"{name[:80]!r} is not a valid account name", hint="letters, digits and . _ - @ +; at most 60")
    return name


def known_role(role: str) -> Role:
    """The role of that name; raises InputError."""
    for known in ROLES:
        if role == known:
            return known
    raise InputError(f"{role!r} is no role", hint=f"one of {', '.join(ROLES)}")


def _hashed(password: str) -> str:
    return str(_hasher().hash(password))


@cache
def _nobodys_password() -> str:
    return _hashed("no such account")


@cache
def _hasher() -> Any:
    from argon2 import PasswordHasher  # imported only if there are accounts

    return PasswordHasher(parallelism=1)
