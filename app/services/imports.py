"""Import of recordings: by upload, by a local path, or as a synthetic sample."""

import time
from itertools import chain, count
from pathlib import Path

from sqlmodel import Session, col, select

from app import archives, schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Account, Event, Job, Project, Upload
from app.errors import Conflict, NotFound
from app.files import project_files, require_free, safe_name
from app.services import project_shapes, projects, quotas
from app.services.context import Context
from app.services.system import allowed_path
from r2c2r_core.errors import CaptureError, InputError

_SAMPLE = "Sample kitchen"  # name of the project and of the recording, from which the bundle takes its title
_SAYS_NOTHING = {"capture", "data", "frames", "recording", "scan"}  # names of recordings, lower case
_LONGEST = 100  # characters of a name before its number


def from_finished_upload(context: Context, upload: Upload, received: Path) -> schemas.Project:
    """A project from a completed upload; may be repeated after an interruption."""
    file_name = safe_name(upload.file_name)
    files = project_files(context.settings.data_dir, upload.id)
    target = files.source / file_name
    if received.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        files.half_made_mark.touch()
        received.replace(target)
    context.store.keep(upload.id)  # before a job can read it
    with writing(context.engine) as session:
        quotas.check_project(context, session)
        name = upload.name or _free_name(context, session, Path(file_name))
        project = projects.new_project(
            session, name, file_name, target, project_id=upload.id, began=upload.created, owner_id=account_of(context, session)
        )
        session.delete(session.merge(upload))
        job = queue_job(context, session, project, "import", {})
    files.half_made_mark.unlink(missing_ok=True)
    return _started(context, project.id, job)


def require_awaited(context: Context, project_id: str) -> None:
    """Raise Conflict for a project that has its recording."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
    if not project_shapes.awaits_recording(project):
        raise Conflict(f"{project.name} has its recording", hint="import another one as a project of its own")


def into_project(context: Context, project_id: str, upload: Upload, received: Path) -> schemas.Project:
    """Add the recording of a project that has none; it is refused if its frames do not match."""
    name = safe_name(upload.file_name)
    with reading(context.engine) as session:
        target = context.files(queries.project_row(session, project_id)).source / name
    target.parent.mkdir(parents=True, exist_ok=True)
    received.replace(target)
    try:
        context.store.keep(project_id)  # before a job can read it
        with writing(context.engine) as session:
            project = queries.project_row(session, project_id)
            if not project_shapes.awaits_recording(project):
                raise Conflict(f"{project.name} got a recording in the meantime", hint="look at it again")
            now = time.time()
            project.source_path, project.source_name, project.status, project.error = str(target), name, "importing", None
            session.add(Event(project_id=project_id, scope="project", action="recording", text=name, who=context.who, at=now))
            session.delete(session.merge(upload))
            job = queue_job(context, session, project, "import", {})
    except BaseException:  # any error: nothing refers to the file, and it need not be sent again
        target.replace(received)
        raise
    return _started(context, project_id, job)


def from_path(context: Context, body: schemas.ImportPath) -> schemas.Project:
    """A project from a recording on this machine, read in place."""
    if context.settings.store:
        raise InputError("this server's jobs run on other machines, which have no such path", hint="upload the recording")
    source = allowed_path(context, body.path)
    if not source.exists():
        raise NotFound(f"{source}: no such file or folder", hint="check the path")
    if source.is_file():
        limits = {"max_bytes": context.settings.max_unpacked_bytes, "max_files": context.settings.max_unpacked_files}
        archives.check_archive(source, source.name, **limits)
    elif not any(source.iterdir()):
        raise CaptureError(f"{source} is empty", hint="choose the recording's folder")
    _require_room(context)
    with writing(context.engine) as session:
        name = body.name or _free_name(context, session, source)
        project = projects.new_project(session, name, source.name, source, owner_id=account_of(context, session))
        job = queue_job(context, session, project, "import", {})
    return _started(context, project.id, job)


def from_sample(context: Context, body: schemas.SampleRequest) -> schemas.Project:
    """A project with a synthetic kitchen and its clicks."""
    _require_room(context)
    with writing(context.engine) as session:
        quotas.check_project(context, session, sample=True)
        project = projects.new_project(
            session, body.name or _SAMPLE, quotas.SAMPLE, None, owner_id=account_of(context, session)
        )
        scan = project_files(context.settings.data_dir, project.id).source / f"{_SAMPLE}.r3d"
        project.source_path = str(scan)
        session.add(project)
        job = queue_job(context, session, project, "sample", body.model_dump(exclude={"name"}))
    return _started(context, project.id, job)


def queue_job(context: Context, session: Session, project: Project, kind: str, payload: dict[str, object]) -> Job:
    """Queue a job."""
    quotas.check_job(context, session)
    job = Job(project_id=project.id, kind=kind, state="queued", payload=payload, who=context.who, created=time.time())
    job.message = "waiting"
    session.add(job)
    session.flush()
    return job


def account_of(context: Context, session: Session) -> int | None:
    """The current user's account; None for the user who started the server."""
    mine = select(Account.id).where(Account.name == context.who)
    return session.exec(mine).first() if context.person.account else None


def _started(context: Context, project_id: str, job: Job) -> schemas.Project:
    context.runner.queued(job.id or 0)
    projects.tell(context, project_id)
    return projects.get_project(context, project_id)


def _require_room(context: Context) -> None:
    require_free(context.settings.data_dir, 0, context.settings.min_free_bytes)


def _free_name(context: Context, session: Session, source: Path) -> str:
    """The recording's name, or its folder's where that says nothing, with a number if the user sees a project of that name."""
    stem = Path(safe_name(source.name)).stem
    name = (safe_name(source.parent.name, stem) if stem.casefold() in _SAYS_NOTHING else stem)[:_LONGEST] or "Recording"
    hidden = col(Project.id).in_(context.access.hidden(context.person))
    taken = {other.casefold() for other in session.exec(select(Project.name).where(~hidden))}
    numbered = (f"{name} {number}" for number in count(2))
    return next(one for one in chain([name], numbered) if one.casefold() not in taken)
