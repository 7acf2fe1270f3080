"""One connection per tab: jobs, masks, saved changes."""

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
    listener, must_fetch = context.hub.join(project, since, epoch)
    try:
        await socket.send_json({"type": "hello", "epoch": context.hub.epoch, "seq": context.hub.seq, "reset": must_fetch})
        listening = asyncio.create_task(_listen(socket, listener))
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


async def _listen(socket: WebSocket, listener: Listener) -> None:
    while True:
        text = await socket.receive_text()
        with contextlib.suppress(ValueError, AttributeError):
            said = json.loads(text)
            if said.get("type") == "watch":
                wanted = said.get("project")
                listener.project = wanted if isinstance(wanted, str) else None
