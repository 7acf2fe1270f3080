"""Resumable uploads of recordings, also across restarts of the server.

The received size is the size of the file itself, so it is always consistent. The upload's id becomes the project's, which
makes finishing idempotent, also after a crash.
"""

import contextlib
import secrets
import time
from collections.abc import AsyncIterator
from pathlib import Path, PurePath

import anyio
from sqlmodel import Session, col, select
from starlette.requests import ClientDisconnect

from app import schemas
from app.db.engine import reading, writing
from app.db.tables import Project, Upload
from app.errors import Conflict, NotFound, TooLarge, Unavailable
from app.files import delete_folder, project_files, require_free, safe_name
from app.services import imports, probing, project_import, projects, quotas
from app.services.context import Context
from r2c2r_core.errors import CaptureError, InputError
from r2c2r_core.ingest.foreign import refuse_foreign

SPARE = 2.5  # required free space relative to the recording, as reading it needs its size again, and more


def begin(context: Context, body: schemas.UploadIn) -> schemas.Upload:
    """Announce a file; refused at once if its name is not a recording's, or it exceeds the limit or the disk."""
    refuse_foreign(PurePath(body.file_name))
    _refuse_size(context, body.size)
    require_free(context.settings.data_dir, int(body.size * SPARE), context.settings.min_free_bytes)
    row = Upload(id=secrets.token_hex(6), who=context.who, created=time.time(), **body.model_dump())
    path = _path(context, row.id)
    with writing(context.engine) as session:
        quotas.check_project(context, session)
        quotas.check_upload(context, session, body.size)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        session.add(row)
    return _shape(context, row)


def unfinished(context: Context) -> list[schemas.Upload]:
    """The user's unfinished uploads, newest first."""
    with reading(context.engine) as session:
        query = select(Upload).where(Upload.who == context.who).order_by(col(Upload.created).desc())
        return [_shape(context, row) for row in session.exec(query)]


def state(context: Context, upload_id: str) -> schemas.Upload:
    """Received size of an upload."""
    with reading(context.engine) as session:
        return _shape(context, _row(context, session, upload_id))


async def append(context: Context, upload_id: str, offset: int, stream: AsyncIterator[bytes]) -> int:
    """Append the stream at `offset` and return the new offset. Received bytes are kept if the sender disconnects."""
    with context.uploads.on(upload_id, "sent"):
        found = await anyio.to_thread.run_sync(state, context, upload_id)
        at = found.offset
        if offset != at:
            raise Conflict(f"{at} bytes are here, and these start at {offset}", hint="go on at `current`", current=at)
        with contextlib.suppress(ClientDisconnect):
            at = await _store(context, upload_id, at, found.size, stream)
    return at


def finish(context: Context, upload_id: str) -> schemas.Project:
    """Create the project of a complete upload; an unreadable one is refused and deleted.

    It waits for a process: call it behind the gate of looks.
    """
    with reading(context.engine) as session:
        if session.get(Project, upload_id) is not None:  # repeated request
            return projects.get_project(context, upload_id)
    with context.uploads.on(upload_id, "finished"):
        row, received = _complete(context, upload_id)
        name = safe_name(row.file_name)
        try:
            probing.check_whole(context, received, name)
            if project_import.is_project(received):
                return project_import.take_in(context, row, received)
            probing.look_at(context, "recording", received, name)
        except InputError:
            _delete(context, upload_id)
            raise
        return imports.from_finished_upload(context, row, _path(context, upload_id))


def give(context: Context, project_id: str, body: schemas.RecordingIn) -> schemas.Project:
    """Add a complete upload as the recording of a project without one; an unreadable one is refused and deleted.

    It waits for a process: call it behind the gate of looks.
    """
    with context.uploads.on(project_id, "finished"), context.uploads.on(body.upload, "finished"):
        imports.require_awaited(context, project_id)
        row, received = _complete(context, body.upload)
        try:
            probing.check_recording(context, received, safe_name(row.file_name))
        except InputError:
            _delete(context, body.upload)
            raise
        return imports.into_project(context, project_id, row, received)


def forget(context: Context, upload_id: str) -> None:
    """Delete an upload and its bytes; raises Unavailable while it is becoming a project."""
    with context.uploads.on(upload_id, "deleted"):
        _delete(context, upload_id)


async def whole(
    context: Context, filename: str, name: str | None, size: int | None, stream: AsyncIterator[bytes]
) -> schemas.Project:
    """A project from a single request; nothing is kept if it is interrupted or refused."""
    _refuse_size(context, size or 0)
    context.gates.looks.check(context.who)  # before a byte is received
    wish = schemas.UploadIn(file_name=filename, size=size or 1, name=name)
    upload = await anyio.to_thread.run_sync(begin, context, wish)
    try:
        received = await _store(context, upload.id, 0, size or context.settings.max_upload_bytes, stream)
        if received == 0:
            raise CaptureError("the upload is empty", hint="choose an .r3d file or a zip")
        if size is not None and received != size:
            raise CaptureError(f"{received} of {size} bytes arrived", hint="upload it again")
        await anyio.to_thread.run_sync(_set_size, context, upload.id, received)
        return await context.gates.looks.run(context.who, finish, context, upload.id)
    except BaseException as error:
        with anyio.CancelScope(shield=True), contextlib.suppress(NotFound):  # refused ones are already deleted
            await anyio.to_thread.run_sync(forget, context, upload.id)
        if isinstance(error, ClientDisconnect):
            raise CaptureError("the connection ended before the last byte", hint="upload it again") from error
        raise


def forget_stopped(context: Context) -> None:
    """Delete stale uploads."""
    limit = time.time() - context.settings.upload_kept_s
    with reading(context.engine) as session:
        rows = session.exec(select(Upload)).all()
    for row in rows:
        with contextlib.suppress(Unavailable, NotFound), context.uploads.on(row.id, "finished"):
            if _touched(_path(context, row.id), row.created) < limit:
                _delete(context, row.id)


async def _store(context: Context, upload_id: str, at: int, size: int, stream: AsyncIterator[bytes]) -> int:
    """Append the stream to the file, up to `size` bytes, and return the end offset."""
    async with await anyio.open_file(_path(context, upload_id), "ab") as out:
        async for chunk in stream:
            if at + len(chunk) > size:
                _refuse_size(context, at + len(chunk))
                raise TooLarge(f"more than the announced {size} bytes", hint="start the upload again")
            if (at + len(chunk)) % (64 << 20) < len(chunk):
                reserve = context.settings.min_free_bytes
                await anyio.to_thread.run_sync(require_free, context.settings.data_dir, 0, reserve)
            await out.write(chunk)
            await out.flush()
            at += len(chunk)
    return at


def _complete(context: Context, upload_id: str) -> tuple[Upload, Path]:
    """An upload and its file; raises Conflict unless it is complete."""
    with reading(context.engine) as session:
        row = _row(context, session, upload_id)
    found = _shape(context, row)
    if found.offset != row.size:
        raise Conflict(f"{found.offset} of {row.size} bytes are here", hint="send the rest first", current=found.offset)
    return row, _present(context, row)


def _delete(context: Context, upload_id: str) -> None:
    with writing(context.engine) as session:
        session.delete(_row(context, session, upload_id))
    delete_bytes(context, upload_id)


def delete_bytes(context: Context, upload_id: str) -> None:
    """Delete the bytes of an abandoned upload, also if they were moved before an interruption of finishing.

    A folder without the upload's marker belongs to a project, regardless of a restored database, and is kept.
    """
    _path(context, upload_id).unlink(missing_ok=True)
    files = project_files(context.settings.data_dir, upload_id)
    if files.half_made:
        delete_folder(files.root)


def _row(context: Context, session: Session, upload_id: str) -> Upload:
    found = session.get(Upload, upload_id)
    if found is None or (found.who != context.who and not context.person.may("admin")):
        raise NotFound("no such upload", hint="begin it anew")
    return found


def _set_size(context: Context, upload_id: str, size: int) -> None:
    with writing(context.engine) as session:
        row = _row(context, session, upload_id)
        row.size = size
        session.add(row)


def _shape(context: Context, row: Upload) -> schemas.Upload:
    try:
        offset = _present(context, row).stat().st_size
    except FileNotFoundError:  # deleted concurrently: the whole file must be sent again
        offset = 0
    return schemas.Upload(offset=offset, **row.model_dump(include={"id", "file_name", "size", "modified", "created"}))


def _present(context: Context, row: Upload) -> Path:
    """The upload's file, already in the project's folder if finishing was interrupted."""
    kept = project_files(context.settings.data_dir, row.id).source / safe_name(row.file_name)
    return kept if kept.exists() else _path(context, row.id)


def _touched(path: Path, otherwise: float) -> float:
    try:
        return path.stat().st_mtime
    except FileNotFoundError:
        return otherwise


def _path(context: Context, upload_id: str) -> Path:
    return context.settings.uploads / f"{upload_id}.part"


def _refuse_size(context: Context, size: int) -> None:
    limit = context.settings.max_upload_bytes
    if size > limit:
        raise TooLarge(
            f"the file is larger than {limit / 1e9:.1f} GB",
            hint="import it by its path, or start the server with a larger --max-upload",
        )
