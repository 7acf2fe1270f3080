"""Seats with their jobs, and the queue."""

from sqlmodel import Session, col, func, select

from app import schemas
from app.db.engine import now, reading, writing
from app.db.tables import Job, Part, Project, Seat
from app.errors import Conflict, NotFound
from app.jobs import seats
from app.services.context import Context


def everyone(context: Context) -> schemas.Seats:
    """The live seats, and the number of waiting jobs."""
    rows = seats.living(context.engine, context.settings) if context.runner.rows.shared else [_this(context)]
    with reading(context.engine) as session:
        waiting = session.exec(select(func.count()).where(Job.state == "queued")).one()
        jobs, at = _running(session), now(session)
    return schemas.Seats(
        waiting=waiting,
        shared=context.runner.rows.shared,
        seats=[_shape(context, row, jobs.get(row.owner, []), at) for row in rows],
    )


def drain(context: Context, seat_id: int, body: schemas.SeatIn) -> schemas.Seats:
    """Start or stop draining a seat; it takes effect with its next heartbeat."""
    if not context.runner.rows.shared:
        raise Conflict("this server is the only seat", hint="stop the server instead: its jobs wait for the next start")
    with writing(context.engine) as session:
        row = session.get(Seat, seat_id)
        if row is None:
            raise NotFound("no such seat", hint="it may have ended")
        row.draining = body.draining
        session.add(row)
    return everyone(context)


def _this(context: Context) -> Seat:
    """The seat of a server with its own database file."""
    settings, at = context.settings, context.runner.began
    return Seat(id=0, owner=context.runner.rows.owner, version=seats.version(), jobs=settings.heavy_jobs, began=at, seen=at)


def _running(session: Session) -> dict[str, list[schemas.SeatJob]]:
    """Running jobs by owner."""
    found: dict[str, list[schemas.SeatJob]] = {}
    rows = session.exec(
        select(Job, Project.name).join(Project).where(col(Job.state).in_(("running", "cancelling"))).order_by(col(Job.id))
    )
    for job, name in rows:
        shape = schemas.SeatJob(
            id=job.id or 0,
            project_id=job.project_id,
            project_name=name,
            kind=job.kind,
            stage=job.stage,
            progress=job.progress,
            objects=[],
        )
        found.setdefault(job.owner or "", []).append(shape)
        for helper, objects in _helping(session, job).items():
            found.setdefault(helper, []).append(shape.model_copy(update={"objects": objects}))
    return found


def _helping(session: Session, job: Job) -> dict[str, list[str]]:
    """Objects of the job being computed by other seats."""
    found: dict[str, list[str]] = {}
    at_work = select(Part).where(Part.job_id == job.id, Part.state == "running", Part.owner != job.owner)
    for part in session.exec(at_work.order_by(col(Part.id))):
        found.setdefault(part.owner or "", []).append(part.name)
    return found


def _shape(context: Context, row: Seat, jobs: list[schemas.SeatJob], at: float) -> schemas.Seat:
    host, process, _ = row.owner.rsplit(":", 2)
    here = row.owner == context.runner.rows.owner
    return schemas.Seat(
        id=row.id or 0,
        host=host,
        process=int(process),
        here=here,
        version=row.version,
        jobs_at_a_time=row.jobs,
        began=row.began,
        silent_s=round(max(at - row.seen, 0.0), 1) if context.runner.rows.shared else 0.0,
        draining=row.draining,
        jobs=jobs,
    )
