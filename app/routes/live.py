"""Live connection of each tab: jobs, masks, saved changes and presence."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, WebSocket, WebSocketDisconnect
from pydantic import ValidationError

from app import schemas
from app.hub import Hub, Listener
from app.security import SESSION_ENDED
from app.services.context import Context
from app.services.people import People
from app.tasks import until_first

router = APIRouter()

HEARTBEAT_S = 15.0
MOST_TABS = 50  # concurrent connections of one user
TOO_MANY_TABS = 4429  # close code beyond the limit, like HTTP 429
LONGEST_MESSAGE = 1000  # characters of a tab's message
SAID = '{"type": "watch", "project": an id or null, "page": one of the app\'s pages, "object": a number or null}'


@router.websocket("/api/live")
async def live(
    socket: WebSocket,
    project: Annotated[schemas.ProjectId | None, Query()] = None,
    since: int | None = None,
    epoch: str | None = None,
) -> None:
    """Messages as they happen; `since` and `epoch` (of the last hello) bring the missed messages, or a reset."""
    context: Context = socket.app.state.context
    person = socket.state.person
    await socket.accept()
    if context.hub.tabs_of(person.name) >= MOST_TABS:
        await socket.close(TOO_MANY_TABS, f"you already have {MOST_TABS} tabs connected: close some")
        return
    listener = context.hub.join(project, since, epoch, person.name, lambda at: context.access.sees(socket.state.person, at))
    try:
        await until_first(
            lambda: _listen(socket, listener, context.hub),
            lambda: _speak(socket, listener, context.hub),
            lambda: _follow_person(socket, listener, context.hub, context.people),
        )
    except (WebSocketDisconnect, RuntimeError):
        pass
    finally:
        context.hub.leave(listener)


async def _speak(socket: WebSocket, listener: Listener, hub: Hub) -> None:
    while True:
        try:
            await socket.send_text(await asyncio.wait_for(listener.next(), HEARTBEAT_S))
        except TimeoutError:
            hub.tell(listener, "ping")


async def _listen(socket: WebSocket, listener: Listener, hub: Hub) -> None:
    """Read the tab's position messages; invalid ones are answered without effect."""
    while (message := await socket.receive())["type"] == "websocket.receive":
        try:
            text = message.get("text") or ""
            if len(text) > LONGEST_MESSAGE:
                raise ValueError(f"{len(text)} characters")
            said = schemas.Watch.model_validate_json(text)
        except ValidationError as error:
            first = error.errors()[0]
            hub.tell(listener, "refused", message=": ".join([*map(str, first["loc"]), first["msg"]]), hint=SAID)
        except ValueError as error:
            hub.tell(listener, "refused", message=f"{error}, at most {LONGEST_MESSAGE}", hint=SAID)
        else:
            hub.move(listener, said.project, said.page, said.object)


async def _follow_person(socket: WebSocket, listener: Listener, hub: Hub, people: People) -> None:
    """Notify the tab of changed rights; close the connection when the session ends."""
    person = socket.state.person
    while (now := await people.until_other(socket.state.session, person)) is not None:
        person = socket.state.person = now
        hub.tell(listener, "you", name=person.name, role=person.role)
        if listener.project is not None:
            hub.show_out(listener.project)
    await socket.close(SESSION_ENDED, "the session has ended")
