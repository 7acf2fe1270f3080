"""Upload of a user's mesh as a candidate: received, validated, then stored."""

import contextlib
import re
import secrets
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import anyio
from starlette.requests import ClientDisconnect

from app import schemas
from app.db import history, queries
from app.db.engine import reading
from app.errors import TooLarge
from app.files import receiving, require_free, safe_name
from app.services import clouds, probing, reviews
from app.services.context import Context
from r2c2r_core.errors import OverrideError
from r2c2r_core.generate.meshfile import MOST_BYTES, SUFFIXES


async def upload(
    context: Context,
    project_id: str,
    object_id: int,
    filename: str,
    stream: AsyncIterator[bytes],
    rerun: bool,
    version: int | None = None,
) -> schemas.Reviewed:
    """Add a candidate from a mesh file; nothing is kept if it is refused or interrupted."""
    name = _mesh_name(filename)
    context.gates.looks.check(context.who)  # before a byte is received
    folder = await anyio.to_thread.run_sync(_folder_for, context, project_id, object_id, version)
    stem = re.sub(r"[^A-Za-z0-9_]+", "_", Path(name).stem)[:40] or "mesh"
    async with _received(context, name, stream) as (received, _):
        target = folder / f"{stem}-{secrets.token_hex(4)}{received.suffix}"
        wish = schemas.OverridePatch.model_construct(
            candidate=str(target), rerun=rerun, version=version
        )  # our own path, of any length
        return await anyio.to_thread.run_sync(_adopt, context, project_id, object_id, received, wish)


async def look(
    context: Context, project_id: str, object_id: int, filename: str, stream: AsyncIterator[bytes]
) -> schemas.MeshLook:
    """Preview of a mesh file as a candidate, with the object's size from its masks; nothing is stored."""
    name = _mesh_name(filename)
    context.gates.looks.check(context.who)
    await anyio.to_thread.run_sync(_folder_for, context, project_id, object_id, None)
    size_m = (await anyio.to_thread.run_sync(clouds.object_points, context, project_id, object_id)).size_m
    async with _received(context, name, stream) as (_, seen):
        return schemas.MeshLook(name=name, object_size_m=sorted(size_m, reverse=True) if any(size_m) else None, **seen)


def _mesh_name(filename: str) -> str:
    """The file's sanitised name; raises OverrideError if its extension is not a mesh format."""
    name = safe_name(filename, "mesh")
    if Path(name).suffix.lower() not in SUFFIXES:
        raise OverrideError(f"{filename!r} is not a mesh this app reads", hint=f"send one of {', '.join(SUFFIXES)}")
    return name


@contextlib.asynccontextmanager
async def _received(context: Context, name: str, stream: AsyncIterator[bytes]) -> AsyncIterator[tuple[Path, dict[str, Any]]]:
    """Context with the received file and its probe result; the file is deleted afterwards unless moved."""
    received = receiving(context.settings.uploads, f"{secrets.token_hex(4)}{Path(name).suffix.lower()}")
    try:
        await _receive(stream, received)
        yield received, await context.gates.looks.run(context.who, probing.look_at, context, "mesh", received, name)
    except ClientDisconnect as error:
        raise OverrideError("the connection ended before the last byte", hint="upload it again") from error
    finally:
        with anyio.CancelScope(shield=True):
            await anyio.Path(received).unlink(missing_ok=True)


def _folder_for(context: Context, project_id: str, object_id: int, version: int | None) -> Path:
    """Folder of the object's uploaded meshes, with all checks possible before receiving."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        history.require_open(project)
        reviews.refuse_overtaken(context, session, project, item, schemas.OverridePatch(version=version))
    require_free(context.settings.data_dir, 0, context.settings.min_free_bytes)
    return context.files(project).uploads / item.name


async def _receive(stream: AsyncIterator[bytes], target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    received = 0
    async with await anyio.open_file(target, "wb") as out:
        async for chunk in stream:
            received += len(chunk)
            if received > MOST_BYTES:
                raise TooLarge(f"the mesh is larger than {MOST_BYTES / 1e6:.0f} MB", hint="simplify it first")
            await out.write(chunk)
    if received == 0:
        raise OverrideError("the upload is empty", hint="choose a mesh file")


def _adopt(context: Context, project_id: str, object_id: int, received: Path, wish: schemas.OverridePatch) -> schemas.Reviewed:
    """Move the file into place and store the correction that refers to it."""
    target = Path(wish.candidate or "")
    target.parent.mkdir(parents=True, exist_ok=True)
    received.replace(target)
    try:
        context.store.keep(project_id)  # before a row refers to it
        job, text = reviews.store_override(context, project_id, object_id, wish)
    except BaseException:  # any error: nothing refers to the file
        target.unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # it may contain other files
            target.parent.rmdir()
        raise
    return reviews.reviewed_shape(context, project_id, object_id, job, text)
