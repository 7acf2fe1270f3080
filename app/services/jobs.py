"""Heavy work: start, watch, cancel, read the log."""

from collections.abc import Sequence
from typing import Any

from sqlmodel import Session, col, select

from app import schemas
from app.db import history, queries
from app.db.engine import reading, writing
from app.db.tables import Job, JobEvent, Project
from app.errors import Conflict, NotReady
from app.privacy import without_places
from app.services import projects
from app.services.context import Context
from app.services.imports import queue_job
from r2c2r_core.errors import PromptError


def run(context: Context, project_id: str, body: schemas.RunRequest) -> schemas.Job:
    """Queue a reconstruction of the project's current state."""
    _check_backends(body)
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        job = queue_run(context, session, project, body)
    context.runner.queued(job.id or 0)
    projects.tell(context, project_id)
    return get_job(context, job.id or 0)


def queue_run(context: Context, session: Session, project: Project, body: schemas.RunRequest, about: Sequence[int] = ()) -> Job:
    """A queued run of the current input, or an active run that already includes it.

    `about` are the objects whose correction starts it; for other objects the clicks of the last run are used.
    """
    if project.status != "ready":
        raise NotReady("the recording has not been read yet", hint="wait for the import")
    if not any(item.masks_key for item in queries.live_objects(session, project.id)):
        raise PromptError("no object has a click on it", hint="click at least one object on the annotate page")
    history.require_open(project)
    chosen = {seam: getattr(body, seam) or getattr(project, seam) for seam in projects.SEAMS}
    for seam, registry in projects.SEAMS.items():
        registry.require(chosen[seam])
    wishes = {**body.model_dump(), **chosen}
    payload = {**wishes, "inputs": project.inputs, **({"about": sorted(about)} if about else {})}
    active = select(Job).where(Job.project_id == project.id, Job.kind == "run", col(Job.state).in_(("queued", "running")))
    for job in session.exec(active):
        if job.state == "queued" and job.started is None:
            job.payload = _joined(job.payload, payload)  # the clicks are read when it starts
            session.add(job)
            return job
        if job.payload == payload:
            return job
    return queue_job(context, session, project, "run", payload)


def _joined(waiting: dict[str, Any], added: dict[str, Any]) -> dict[str, Any]:
    """Merged payload of a waiting run and a further request: everything, unless both concern single objects."""
    if "about" not in added:
        return added
    if "about" not in waiting:
        return {**waiting, "inputs": added["inputs"]}
    return {**added, "about": sorted({*waiting["about"], *added["about"]})}


def list_jobs(context: Context, project_id: str | None, limit: int) -> list[schemas.Job]:
    """Jobs, newest first."""
    with reading(context.engine) as session:
        shown = col(Job.project_id).not_in(context.access.hidden(context.person))
        query = select(Job).where(shown).order_by(col(Job.id).desc()).limit(min(max(limit, 1), 500))
        if project_id is not None:
            query = query.where(Job.project_id == project_id)
        return queries.job_shapes(session, session.exec(query).all())


def get_job(context: Context, job_id: int) -> schemas.Job:
    """One job."""
    with reading(context.engine) as session:
        return queries.job_shapes(session, [queries.job_row(session, job_id)])[0]


def cancel(context: Context, job_id: int) -> schemas.Job:
    """Ask the job to stop."""
    context.runner.cancel(job_id)
    return get_job(context, job_id)


def retry(context: Context, job_id: int) -> schemas.Job:
    """Queue a failed or cancelled job again; a run uses the current clicks."""
    with writing(context.engine) as session:
        row = queries.job_row(session, job_id)
        project = queries.project_row(session, row.project_id)
        if row.state not in ("failed", "cancelled"):
            raise Conflict(f"the job is {row.state}", hint="only failed or cancelled jobs can be retried")
        if row.kind == "run":
            wishes = {name: value for name, value in row.payload.items() if name in schemas.RunRequest.model_fields}
            job = queue_run(context, session, project, schemas.RunRequest(**wishes), row.payload.get("about", ()))
        else:
            if said := queries.no_retry(row.kind, project.source_path):
                raise Conflict(said, hint="delete the project, and upload another one")
            if row.kind in queries.READS_RECORDING:
                project.status, project.error = "importing", None
                session.add(project)
            job = queue_job(context, session, project, row.kind, row.payload)
    context.runner.queued(job.id or 0)
    projects.tell(context, job.project_id)
    return get_job(context, job.id or 0)


def events(context: Context, job_id: int, after: int) -> list[schemas.JobEvent]:
    """The job's events after a given one."""
    with reading(context.engine) as session:
        queries.job_row(session, job_id)
        rows = session.exec(
            select(JobEvent).where(JobEvent.job_id == job_id, col(JobEvent.id) > after).order_by(col(JobEvent.id))
        )
        return [schemas.JobEvent(**row.model_dump(exclude={"job_id"})) for row in rows]


def log(context: Context, job_id: int, tail: int) -> str:
    """The end of the job's log."""
    with reading(context.engine) as session:
        row = queries.job_row(session, job_id)
        if row.log_path is None:
            return ""
        path = context.files(queries.project_row(session, row.project_id)).here(row.log_path)
    if row.owner != context.runner.rows.owner:
        context.store.fetch_log(row.project_id, path)
    if not path.is_file():
        return ""
    wanted = min(max(tail, 1), 2_000_000)
    with path.open("rb") as handle:
        handle.seek(max(path.stat().st_size - wanted, 0))
        text = handle.read(wanted).decode(errors="replace")
    return text if context.person.may("admin") else without_places(text, context.settings)


def _check_backends(body: schemas.RunRequest) -> None:
    """Refuse unknown backends before anything is queued."""
    for seam, registry in projects.SEAMS.items():
        if (name := getattr(body, seam)) is not None:
            registry.get(name)
