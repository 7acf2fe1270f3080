"""One connection per tab: jobs, masks, saved changes, and who else is here."""

import asyncio
import contextlib
import json

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from app.hub import Hub, Listener
from app.security import SESSION_ENDED
from app.services.context import Context
from app.services.people import People
from app.tasks import until_first

router = APIRouter()

HEARTBEAT_S = 15.0


@router.websocket("/api/live")
async def live(socket: WebSocket, project: str | None = None, since: int | None = None, epoch: str | None = None) -> None:
    """Messages as they happen; `since` and `epoch` (of the last hello) bring what was missed, or a reset."""
    context: Context = socket.app.state.context
    await socket.accept()
    listener, must_fetch = context.hub.join(project, since, epoch, socket.state.person.name)
    try:
        hello = {"type": "hello", "epoch": context.hub.epoch, "seq": context.hub.seq, "reset": must_fetch, "tab": listener.tab}
        await socket.send_json(hello)
        await until_first(
            lambda: _listen(socket, listener, context.hub),
            lambda: _speak(socket, listener, context.hub),
            lambda: _follow_person(socket, listener, context.people),
        )
    except (WebSocketDisconnect, RuntimeError):
        pass
    finally:
        context.hub.leave(listener)


async def _speak(socket: WebSocket, listener: Listener, hub: Hub) -> None:
    while True:
        try:
            message = await asyncio.wait_for(listener.queue.get(), HEARTBEAT_S)
        except TimeoutError:
            message = {"type": "ping", "seq": hub.seq}
        await socket.send_json(message)


async def _listen(socket: WebSocket, listener: Listener, hub: Hub) -> None:
    while True:
        text = await socket.receive_text()
        with contextlib.suppress(ValueError, AttributeError):
            said = json.loads(text)
            if said.get("type") == "watch":
                project, page, number = (said.get(name) for name in ("project", "page", "object"))
                hub.move(
                    listener,
                    project if isinstance(project, str) else None,
                    page[:20] if isinstance(page, str) else "",
                    number if isinstance(number, int) else None,
                )


async def _follow_person(socket: WebSocket, listener: Listener, people: People) -> None:
    """Say when the person may do more or less than before; close when the session has ended."""
    person = socket.state.person
    while (now := await people.until_other(socket.state.session, person)) is not None:
        person = now
        listener.queue.put_nowait({"type": "you", "name": person.name, "role": person.role})
    await socket.close(SESSION_ENDED, "the session has ended")
