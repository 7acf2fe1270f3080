"""Audit log of sign-ins, refusals and account changes, shown to admins on the page People."""

import contextlib
import time

from sqlalchemy import Engine
from sqlmodel import Session, col, delete, func, select

from app import schemas
from app.db.engine import reading, writing
from app.db.tables import Account, AuditEntry
from r2c2r_core.errors import R2C2RError

COMMAND_LINE = "the command line"  # author of changes by `r2c2r user` and `r2c2r token`
MOST_REFUSALS = 5000  # maximum stored, so that a month of password guessing does not fill the disk
REFUSED: schemas.AuditAction = "refused"


def note(session: Session, action: schemas.AuditAction, *, account: str, who: str, client: str = "", detail: str = "") -> None:
    """Add an entry in the transaction of the event; `account` is the affected one, `who` the author."""
    session.add(AuditEntry(at=time.time(), action=action, account=account, who=who, client=client, detail=detail))


def note_refusal(engine: Engine, name: str, client: str, detail: str) -> None:
    """Record a refused sign-in; an unknown name is not stored, as users type passwords there by mistake."""
    with contextlib.suppress(R2C2RError), writing(engine) as session:  # on a full disk, refusals continue without a record
        known = session.exec(select(Account.name).where(Account.name == name.lower())).first() or ""
        note(session, REFUSED, account=known, who="", client=client, detail=detail)
        session.flush()
        newest = select(AuditEntry.id).where(AuditEntry.action == REFUSED).order_by(col(AuditEntry.id).desc())
        oldest_kept = session.exec(newest.offset(MOST_REFUSALS - 1).limit(1)).first()
        if oldest_kept is not None:
            older = (col(AuditEntry.action) == REFUSED, col(AuditEntry.id) < oldest_kept)
            session.exec(delete(AuditEntry).where(*older))


def entries(engine: Engine, before: int | None, limit: int) -> schemas.AuditPage:
    """The newest entries before a given one."""
    with reading(engine) as session:
        query = select(AuditEntry).order_by(col(AuditEntry.id).desc()).limit(limit)
        if before is not None:
            query = query.where(col(AuditEntry.id) < before)
        rows = session.exec(query).all()
        total = session.exec(select(func.count()).select_from(AuditEntry)).one()
    return schemas.AuditPage(entries=[schemas.AuditEntry.model_validate(row.model_dump()) for row in rows], total=total)
