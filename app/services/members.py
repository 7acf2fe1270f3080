"""Who may sign in at this server: what an admin sees of the accounts and changes about them."""

import threading

from sqlalchemy import func
from sqlmodel import Session, col, select

from app import schemas
from app.db.engine import reading
from app.db.tables import Account, SignIn
from app.errors import Conflict
from app.services import accounts
from app.services.context import Context

_changing = threading.Lock()  # two admins at once do not both pass as not the last one


def everyone(context: Context) -> list[schemas.AccountInfo]:
    """All accounts by name."""
    with reading(context.engine) as session:
        return [_shape(context, session, account) for account in session.exec(select(Account).order_by(col(Account.name)))]


def add(context: Context, body: schemas.AccountIn) -> schemas.AccountInfo:
    """A new account."""
    accounts.add(context.engine, body.name, body.role, body.password)
    return _one(context, body.name)


def change(context: Context, name: str, body: schemas.AccountPatch) -> schemas.AccountInfo:
    """Another role, another password; both hold at once, on open connections too."""
    with _changing:
        if body.role is not None and body.role != "admin":
            _refuse_last_admin(context, name)
        if body.password is not None:
            accounts.set_password(context.engine, name, body.password)
        if body.role is not None:
            accounts.set_role(context.engine, name, body.role)
    context.people.look_again()
    return _one(context, name)


def remove(context: Context, name: str) -> None:
    """Delete the account: its sessions and open connections end; what the person did keeps the name."""
    with _changing:
        _refuse_last_admin(context, name)
        accounts.remove(context.engine, name)
    context.people.look_again()


def _refuse_last_admin(context: Context, name: str) -> None:
    """A server that others can reach keeps somebody who may let people in."""
    admins = [person.name for person in accounts.everyone(context.engine) if person.role == "admin"]
    if context.settings.accounts_only and admins == [name.lower()]:
        raise Conflict(f"{name} is the only admin", hint="make somebody else admin first")


def _one(context: Context, name: str) -> schemas.AccountInfo:
    with reading(context.engine) as session:
        return _shape(context, session, accounts.row(session, name))


def _shape(context: Context, session: Session, account: Account) -> schemas.AccountInfo:
    used = session.exec(select(func.max(SignIn.used)).where(SignIn.account_id == account.id)).one()
    person = accounts.person(account)
    you = context.person.account and context.person.name == person.name
    return schemas.AccountInfo(name=person.name, role=person.role, created=account.created, used=used, you=you)
