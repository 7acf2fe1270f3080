"""Proxy of viser through the app's own origin: its page with added style rules, and its WebSocket in both directions."""

import contextlib
import http.client
from collections.abc import Awaitable, Callable

import anyio
import websockets
from starlette.responses import Response
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.typing import Subprotocol

from app.errors import NotFound, Unavailable
from app.security import SESSION_ENDED
from app.tasks import until_first
from app.viewer.contract import KEY_HEADER

PAGE_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; worker-src blob:; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "connect-src 'self' data: blob:; frame-ancestors 'self'"
)
# viser's client reconnects only while its document has the focus, which the parent page keeps; its panels are not ours
INJECTED = (
    b'<script>document.hasFocus=()=>true</script><script src="/static/js/viewer-page.js"></script>'
    b"<style>[data-floating-window],[data-dock-leaf],"
    b".mantine-Paper-root:has(.mantine-ScrollArea-root){display:none!important}"  # the panel of a narrow window
    b".mantine-Notifications-root{display:none!important}</style>"
)


async def fetch_page(port: int, path: str, key: str, answer_s: float) -> Response:
    """A file of viser's client; its page is adapted to run in an iframe."""
    try:
        status, content_type, content = await anyio.to_thread.run_sync(_fetch, port, path, key, answer_s)
    except OSError as error:
        raise Unavailable("the 3D view does not answer", hint="open the review page again") from error
    if status != 200:
        raise NotFound("the 3D view has no such file")
    if content_type.startswith("text/html"):
        content = content.replace(b"<head>", b"<head>" + INJECTED, 1)
    headers = {"content-security-policy": PAGE_POLICY, "cache-control": "no-store", "content-type": content_type}
    return Response(content, headers=headers)


async def pump(socket: WebSocket, port: int, key: str, answer_s: float, session_end: Callable[[], Awaitable[object]]) -> None:
    """Forward messages in both directions until either side leaves, or the session ends."""
    wanted = [Subprotocol(name) for name in socket.scope["subprotocols"]]
    try:
        upstream = await websockets.connect(
            f"ws://127.0.0.1:{port}/",
            subprotocols=wanted or None,
            max_size=None,
            compression=None,
            proxy=None,
            open_timeout=answer_s,
            additional_headers={KEY_HEADER: key},
        )
    except (OSError, websockets.WebSocketException):
        await socket.close(1013, "the 3D view does not answer")
        return
    async with upstream:
        await socket.accept(subprotocol=upstream.subprotocol)
        first = await until_first(lambda: _up(socket, upstream), lambda: _down(socket, upstream), session_end)
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # already closed by the browser
        if first == 2:
            await socket.close(SESSION_ENDED, "the session has ended")
            return
        await socket.close(upstream.close_code if upstream.close_code in (1002, 1011) else 1000)


async def _up(socket: WebSocket, upstream: websockets.ClientConnection) -> None:
    with contextlib.suppress(WebSocketDisconnect, websockets.ConnectionClosed):
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            content = message.get("bytes")
            await upstream.send(content if content is not None else message["text"])


async def _down(socket: WebSocket, upstream: websockets.ClientConnection) -> None:
    with contextlib.suppress(WebSocketDisconnect, websockets.ConnectionClosed, RuntimeError):
        async for content in upstream:
            await (socket.send_bytes(content) if isinstance(content, bytes) else socket.send_text(content))


def _fetch(port: int, path: str, key: str, answer_s: float) -> tuple[int, str, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=answer_s)
    try:
        connection.request("GET", f"/{path}", headers={KEY_HEADER: key})
        answer = connection.getresponse()
        return answer.status, answer.getheader("content-type", "application/octet-stream"), answer.read()
    finally:
        connection.close()
