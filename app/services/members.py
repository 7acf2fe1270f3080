"""Account management for admins.

Functions that take a password hash it: call them behind the password gate.
"""

from sqlalchemy import func
from sqlmodel import Session, col, select

from app import schemas
from app.db.engine import reading
from app.db.tables import Account, SignIn
from app.services import accounts, audit, crossing
from app.services.context import Context


def everyone(context: Context) -> list[schemas.AccountInfo]:
    """All accounts by name."""
    with reading(context.engine) as session:
        return [_shape(context, session, account) for account in session.exec(select(Account).order_by(col(Account.name)))]


def record(context: Context, before: int | None, limit: int) -> schemas.AuditPage:
    """Audit entries of sign-ins, refusals and account changes, newest first."""
    return audit.entries(context.engine, before, limit)


def add(context: Context, body: schemas.AccountIn) -> schemas.AccountInfo:
    """Add an account."""
    accounts.add(context.engine, body.name, body.role, body.password, by=context.who)
    return _one(context, body.name)


def change(context: Context, name: str, body: schemas.AccountPatch) -> schemas.AccountInfo:
    """Change role or password, effective at once, also on open connections."""
    accounts.change(context.engine, name, role=body.role, password=body.password, by=context.who)
    context.people.look_again()
    return _one(context, name)


def remove(context: Context, name: str) -> None:
    """Delete the account and end its sessions and connections; the history keeps the name."""
    accounts.remove(context.engine, name, by=context.who)
    context.people.look_again()
    crossing.sees_changed(context)


def _one(context: Context, name: str) -> schemas.AccountInfo:
    with reading(context.engine) as session:
        return _shape(context, session, accounts.row(session, name))


def _shape(context: Context, session: Session, account: Account) -> schemas.AccountInfo:
    used = session.exec(select(func.max(SignIn.used)).where(SignIn.account_id == account.id)).one()
    person = accounts.person(account)
    you = context.person.account and context.person.name == person.name
    return schemas.AccountInfo(name=person.name, role=person.role, created=account.created, used=used, you=you)
