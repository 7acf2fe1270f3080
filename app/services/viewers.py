"""The 3D view: content and access."""

from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

from fastapi import WebSocket
from fastapi.responses import Response
from sqlmodel import Session

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.db.keys import overrides_entry
from app.errors import Forbidden, NotReady, TooMany, Unavailable
from app.files import ProjectFiles
from app.jobs.plain import plain
from app.services import marks, views
from app.services.candidates import facts_of
from app.services.context import Context
from app.viewer import proxy

_CLOSING: dict[type[Exception], int] = {Forbidden: 4403, TooMany: 4429}  # HTTP status codes in the application range


def open_view(context: Context, project_id: str, session_id: str) -> schemas.ViewerSession:
    """Address of the 3D view, or a fallback."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        bundle = queries.newest_bundle(session, project_id)
    if project.status != "ready":
        raise NotReady("the recording has not been read yet", hint="wait for the import")
    instead = {
        "fallback_page": f"/media/{project_id}/review.html?v={bundle.version}" if bundle else None,
        "fallback_image": f"/media/{project_id}/preview.png?v={bundle.version}"
        if bundle
        else f"/media/{project_id}/thumbnail.jpg",
    }
    try:
        token = context.viewer.open(project_id, context.files(project).work, session_id)
    except Unavailable as error:
        return schemas.ViewerSession(state="down", url=None, message=str(error), **instead)
    return schemas.ViewerSession(state="ready", url=f"/viewer/{token}/", message="", **instead)


def show(context: Context, project_id: str, session_id: str, body: schemas.ViewerShow) -> schemas.ViewerShown:
    """Change the content of the 3D view."""
    from app.services.meshes import upright

    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, body.object) if body.object is not None else None
    wish: dict[str, Any] = body.model_dump(exclude={"object"})
    files = context.files(project)
    if item is not None:
        wish["name"] = item.result_name
    if body.mode == "candidate":
        if item is None:
            raise NotReady("no object is given for the candidate", hint="give the object")
        wish["candidate"] = body.candidate or _chosen(context, project_id, item.id or 0)
        wish["rotation"] = upright(files, item.result_name, wish["candidate"]).tolist()
    if body.mode == "scene":
        with reading(context.engine) as session:
            wish["marks"], wish["focus"] = marks.marks(session, files, project_id, item.result_name if item else body.made)
            wish |= _corrections(session, files, project_id)
    return schemas.ViewerShown.model_validate(context.viewer.show(project_id, files.work, session_id, wish))


def _corrections(session: Session, files: ProjectFiles, project_id: str) -> dict[str, Any]:
    """Corrections possibly newer than the newest scene, by object, and objects whose placed mesh was rejected or replaced."""
    stored = queries.overrides_by_object(session, project_id)
    said = {item.result_name: stored[item.id or 0] for item in queries.live_objects(session, project_id) if item.id in stored}
    entries = {name: overrides_entry({k: v for k, v in data.items() if k != "candidate"}) for name, data in said.items()}
    placed = {name: (views.facts(files, "align", name, plain) or {}).get("candidate_id") for name in said}
    gone = [
        name
        for name, data in said.items()
        if placed[name] in data.get("rejected", []) or data.get("candidate") in _made(files, name) - {placed[name]}
    ]
    return {"corrections": {name: entry for name, entry in entries.items() if entry}, "undressed": gone}


def _made(files: ProjectFiles, name: str) -> set[str]:
    facts = facts_of(files, name)
    return {candidate["candidate_id"] for candidate in facts["candidates"]} if facts else set()


def picked(context: Context, project_id: str, session_id: str) -> schemas.ViewerPicked:
    """The object or point of the last click in the 3D view."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        numbers = {item.result_name: item.id for item in queries.live_objects(session, project_id)}
    found = context.viewer.picked(project_id, context.files(project).work, session_id)
    return schemas.ViewerPicked(object=numbers.get(found["name"]), **found)


def camera(context: Context, project_id: str, session_id: str) -> schemas.ViewerCamera:
    """Camera of the 3D view."""
    return schemas.ViewerCamera.model_validate(context.viewer.camera(project_id, _workdir(context, project_id), session_id))


def set_joints(context: Context, project_id: str, session_id: str, values: dict[str, float]) -> schemas.ViewerShown:
    """Move joints of the shown scene."""
    shown = context.viewer.move(project_id, _workdir(context, project_id), session_id, values)
    return schemas.ViewerShown.model_validate(shown)


def place(context: Context, project_id: str, session_id: str, body: schemas.ViewerPlace) -> schemas.ViewerPlaced:
    """Set or return the pose of the object being moved."""
    placed = context.viewer.place(project_id, _workdir(context, project_id), session_id, body.pose)
    return schemas.ViewerPlaced.model_validate(placed)


async def page(context: Context, token: str, path: str, session_id: str) -> Response:
    """The 3D view's page, or a file of it."""
    port = await _port(context, token, session_id)
    return await proxy.fetch_page(port, quote(path), context.viewer.key, context.settings.viewer_page_s)


async def socket(context: Context, token: str, connection: WebSocket) -> None:
    """Connect a WebSocket to the 3D view."""
    person = connection.state.person
    try:
        with context.viewer.watched(token, person.name):
            port = await _port(replace(context, person=person), token, connection.state.session)
            page_s = context.settings.viewer_page_s
            await proxy.pump(connection, port, context.viewer.key, page_s, lambda: _session_end(context, connection))
    except (Forbidden, TooMany, Unavailable) as error:
        await connection.close(_CLOSING.get(type(error), 1013), error.message)


async def _port(context: Context, token: str, session_id: str) -> int:
    """Port of the view behind the token, waiting only for a restart."""
    running = context.viewer.running_port(token, session_id)
    if running is not None:
        return running
    return await context.gates.views.run(context.who, context.viewer.port, token, session_id)


async def _session_end(context: Context, connection: WebSocket) -> None:
    """Returns when the session of the connection has ended; any role may look."""
    person = connection.state.person
    while person is not None:
        person = await context.people.until_other(connection.state.session, person)


def _workdir(context: Context, project_id: str) -> Path:
    with reading(context.engine) as session:
        return context.files(queries.project_row(session, project_id)).work


def _chosen(context: Context, project_id: str, object_id: int) -> str:
    from app.services.reviews import group

    return group(context, project_id, object_id).chosen
