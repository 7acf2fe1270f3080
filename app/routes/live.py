"""One connection per tab: jobs, masks, saved changes, and who else is here."""

import asyncio
import contextlib
import json

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from app.hub import Hub, Listener
from app.services.context import Context

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
        listening = asyncio.create_task(_listen(socket, listener, context.hub))
        speaking = asyncio.create_task(_speak(socket, listener, context.hub))
        _, pending = await asyncio.wait({listening, speaking}, return_when=asyncio.FIRST_COMPLETED)
        for task in pending:
            task.cancel()
        await asyncio.gather(listening, speaking, return_exceptions=True)
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
