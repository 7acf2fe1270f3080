"""How recordings get in: by upload, by a path on this machine, or made up."""

import contextlib
import time
from collections.abc import AsyncIterator
from pathlib import Path

import anyio
from sqlmodel import Session
from starlette.requests import ClientDisconnect

from app import archives, schemas
from app.db import queries
from app.db.engine import writing
from app.db.tables import Job, Project
from app.errors import NotFound, TooLarge
from app.files import delete_folder, project_files, require_free, safe_name
from app.services import projects
from app.services.context import Context
from app.services.system import allowed_path
from r2c2r_core.errors import CaptureError

CHUNK_SPARE = 2.5  # a recording needs its own size again when it is read, and some more


async def from_upload(
    context: Context, filename: str, name: str | None, size: int | None, stream: AsyncIterator[bytes]
) -> schemas.Project:
    """A project from uploaded bytes; they go straight to the disk, and nothing stays when they are refused."""
    _refuse_size(context, size or 0)
    await anyio.to_thread.run_sync(_require_room, context, size or 0)
    with writing(context.engine) as session:
        project = projects.new_project(session, _name(name, filename), safe_name(filename), None)
        project.status = "failed"  # until the bytes are here: a crash now leaves a project that can be deleted
        project.error = {
            "kind": "upload",
            "message": "the upload did not finish",
            "hint": "delete the project and upload again",
        }
        session.add(project)
    folder = project_files(context.settings.data_dir, project.id).source
    target = folder / safe_name(filename)
    try:
        await _receive(context, stream, target, size)
        limits = {"max_bytes": context.settings.max_unpacked_bytes, "max_files": context.settings.max_unpacked_files}
        await anyio.to_thread.run_sync(lambda: archives.check_archive(target, **limits))
    except ClientDisconnect as error:
        await anyio.to_thread.run_sync(_forget, context, project.id)
        raise CaptureError("the sender left before the last byte", hint="upload it again") from error
    except BaseException:
        with anyio.CancelScope(shield=True):
            await anyio.to_thread.run_sync(_forget, context, project.id)
        raise
    with writing(context.engine) as session:
        row = queries.project_row(session, project.id)
        row.source_path, row.status, row.error = str(target), "importing", None
        session.add(row)
        job = queue_job(context, session, row, "import", {})
    return _started(context, project.id, job)


def from_path(context: Context, body: schemas.ImportPath) -> schemas.Project:
    """A project from a recording on this machine; it is read where it is."""
    source = allowed_path(context, body.path)
    if not source.exists():
        raise NotFound(f"{source}: no such file or folder", hint="check the path")
    if source.is_file():
        limits = {"max_bytes": context.settings.max_unpacked_bytes, "max_files": context.settings.max_unpacked_files}
        archives.check_archive(source, **limits)
    elif not any(source.iterdir()):
        raise CaptureError(f"{source} is empty", hint="choose the recording's folder")
    _require_room(context, 0)
    with writing(context.engine) as session:
        project = projects.new_project(session, _name(body.name, source.name), source.name, source)
        job = queue_job(context, session, project, "import", {})
    return _started(context, project.id, job)


def from_sample(context: Context, body: schemas.SampleRequest) -> schemas.Project:
    """A project with a synthetic kitchen and its clicks."""
    _require_room(context, 0)
    with writing(context.engine) as session:
        project = projects.new_project(session, body.name or "Sample kitchen", "sample", None)
        scan = project_files(context.settings.data_dir, project.id).source / "scan.r3d"
        project.source_path = str(scan)
        session.add(project)
        job = queue_job(context, session, project, "sample", body.model_dump(exclude={"name"}))
    return _started(context, project.id, job)


def queue_job(context: Context, session: Session, project: Project, kind: str, payload: dict[str, object]) -> Job:
    """Put a job into the queue."""
    job = Job(project_id=project.id, kind=kind, state="queued", payload=payload, who=context.who, created=time.time())
    job.message = "waiting"
    session.add(job)
    session.flush()
    return job


def _started(context: Context, project_id: str, job: Job) -> schemas.Project:
    context.runner.wake()
    context.runner.tell(job.id or 0)
    projects.tell(context, project_id)
    return projects.get_project(context, project_id)


async def _receive(context: Context, stream: AsyncIterator[bytes], target: Path, size: int | None) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    received = 0
    async with await anyio.open_file(target, "wb") as out:
        async for chunk in stream:
            received += len(chunk)
            _refuse_size(context, received)
            if received % (64 << 20) < len(chunk):
                await anyio.to_thread.run_sync(_require_room, context, 0)
            await out.write(chunk)
    if received == 0:
        raise CaptureError("the upload is empty", hint="choose an .r3d file or a zip")
    if size is not None and received != size:
        raise CaptureError(f"{received} of {size} bytes arrived", hint="upload it again")


def _refuse_size(context: Context, size: int) -> None:
    limit = context.settings.max_upload_bytes
    if size > limit:
        raise TooLarge(
            f"the file is larger than {limit / 1e9:.1f} GB", hint="import it by its path on this machine, or raise the limit"
        )


def _require_room(context: Context, size: int) -> None:
    require_free(context.settings.data_dir, int(size * CHUNK_SPARE), context.settings.min_free_bytes)


def _forget(context: Context, project_id: str) -> None:
    with contextlib.suppress(NotFound), writing(context.engine) as session:
        session.delete(queries.project_row(session, project_id))
    delete_folder(project_files(context.settings.data_dir, project_id).root)


def _name(name: str | None, filename: str) -> str:
    return (name or "").strip()[:120] or Path(safe_name(filename)).stem or "Recording"
