"""Quotas per user. Admins are exempt, as they could raise them anyway."""

from sqlalchemy import func
from sqlmodel import Session, col, select

from app.db.queries import ACTIVE
from app.db.tables import Account, Job, Project, Upload
from app.errors import Conflict, TooMany
from app.services.context import Context

SAMPLE = "sample"  # value of the column source_name for a synthetic kitchen
RAISE = "an admin can raise it: r2c2r serve --quota"


def check_job(context: Context, session: Session) -> None:
    """Raise TooMany at the limit of the user's waiting and running jobs."""
    most = context.settings.quotas.jobs
    if _free(context):
        return
    mine = select(func.count()).select_from(Job).where(Job.who == context.who, col(Job.state).in_(ACTIVE))
    found = session.exec(mine).one()
    if found >= most:
        raise TooMany(
            f"{found} of your jobs are waiting or running, the limit is {most}",
            hint=f"wait for one, or cancel one; {RAISE} jobs=N",
        )


def check_upload(context: Context, session: Session, size: int) -> None:
    """Raise TooMany at the limit of the user's unfinished uploads, or of their bytes."""
    quotas = context.settings.quotas
    if _free(context):
        return
    mine = select(func.count(), func.coalesce(func.sum(Upload.size), 0)).where(Upload.who == context.who)
    found, announced = map(int, session.exec(mine).one())  # Postgres sums in decimals
    stop = "finish or cancel one of your uploads"
    if found >= quotas.uploads:
        raise TooMany(
            f"{found} of your uploads are under way, the limit is {quotas.uploads}", hint=f"{stop}; {RAISE} uploads=N"
        )
    if announced + size > quotas.upload_gb * 2**30:
        said = f"your uploads would be {(announced + size) / 2**30:.1f} GB, the limit is {quotas.upload_gb} GB"
        raise TooMany(said, hint=f"{stop}; {RAISE} upload_gb=N")


def check_project(context: Context, session: Session, *, sample: bool = False) -> None:
    """Raise Conflict at the limit of the user's projects, or samples."""
    quotas = context.settings.quotas
    if _free(context):
        return
    owned = col(Project.owner_id).in_(select(Account.id).where(Account.name == context.who))
    mine = select(func.count()).where(owned, col(Project.trashed).is_(None))
    _refuse_beyond("projects", quotas.projects, session.exec(mine).one())
    if sample:
        _refuse_beyond("samples", quotas.samples, session.exec(mine.where(Project.source_name == SAMPLE)).one())


def _refuse_beyond(name: str, most: int, found: int) -> None:
    if found >= most:
        raise Conflict(f"you have {found} {name}, the limit is {most}", hint=f"ask an admin to delete one; {RAISE} {name}=N")


def _free(context: Context) -> bool:
    return context.person.may("admin")
