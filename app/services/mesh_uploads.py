"""A mesh that a person made, as a candidate: received, looked at, and only then kept."""

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
    """The object's candidate from a mesh file; nothing of it stays when it is refused or breaks off."""
    name = _mesh_name(filename)
    context.gates.looks.check(context.who)  # before a byte is received
    folder = await anyio.to_thread.run_sync(_folder_for, context, project_id, object_id, version)
    stem = re.sub(r"[^A-Za-z0-9_]+", "_", Path(name).stem)[:40] or "mesh"
    async with _received(context, name, stream) as (received, _):
        target = folder / f"{stem}-{secrets.token_hex(4)}{received.suffix}"
        wish = schemas.OverridePatch.model_construct(candidate=str(target), rerun=rerun, version=version)  # ours, however long
        return await anyio.to_thread.run_sync(_adopt, context, project_id, object_id, received, wish)


async def look(
    context: Context, project_id: str, object_id: int, filename: str, stream: AsyncIterator[bytes]
) -> schemas.MeshLook:
    """What a mesh file would be used as, beside the size of what the object's masks show; nothing of it is kept."""
    name = _mesh_name(filename)
    context.gates.looks.check(context.who)
    await anyio.to_thread.run_sync(_folder_for, context, project_id, object_id, None)
    size_m = (await anyio.to_thread.run_sync(clouds.object_points, context, project_id, object_id)).size_m
    async with _received(context, name, stream) as (_, seen):
        return schemas.MeshLook(name=name, object_size_m=sorted(size_m, reverse=True) if any(size_m) else None, **seen)


def _mesh_name(filename: str) -> str:
    """The file's name, made safe; raises OverrideError for what is no mesh by its ending."""
    name = safe_name(filename, "mesh")
    if Path(name).suffix.lower() not in SUFFIXES:
        raise OverrideError(f"{filename!r} is not a mesh this app reads", hint=f"send one of {', '.join(SUFFIXES)}")
    return name


@contextlib.asynccontextmanager
async def _received(context: Context, name: str, stream: AsyncIterator[bytes]) -> AsyncIterator[tuple[Path, dict[str, Any]]]:
    """The file while it is used, and what was seen of it; what is still there afterwards is deleted."""
    received = receiving(context.settings.uploads, f"{secrets.token_hex(4)}{Path(name).suffix.lower()}")
    try:
        await _receive(stream, received)
        yield received, await context.gates.looks.run(context.who, probing.look_at, context, "mesh", received, name)
    except ClientDisconnect as error:
        raise OverrideError("the sender left before the last byte", hint="upload it again") from error
    finally:
        with anyio.CancelScope(shield=True):
            await anyio.Path(received).unlink(missing_ok=True)


def _folder_for(context: Context, project_id: str, object_id: int, version: int | None) -> Path:
    """Where the object's uploaded meshes are; raises what can be known to be wrong before a byte is received."""
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
    """Keep the file for as long as the correction that names it is stored."""
    target = Path(wish.candidate or "")
    target.parent.mkdir(parents=True, exist_ok=True)
    received.replace(target)
    try:
        context.store.keep(project_id)  # before a row names it
        job, text = reviews.store_override(context, project_id, object_id, wish)
    except BaseException:  # whatever it was: nothing names the file
        target.unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # others lie in it
            target.parent.rmdir()
        raise
    return reviews.reviewed_shape(context, project_id, object_id, job, text)
