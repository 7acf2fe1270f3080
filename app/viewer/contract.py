"""All private interfaces of viser 1.1.1 used by this app; a test runs `check` against the installed version.

1. `ViserServer._websock_server.unregister_handler`: removes the handlers with which any page could open a public tunnel.
2. `websockets.asyncio.server.serve`, as called by viser: every request must carry the key known only to the app's proxy,
   so that a page of another site, or another user of this machine, gets nothing from the port.
"""

from http import HTTPStatus
from typing import Any

import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

VERSION = "1.1.1"
KEY_HEADER = "X-R2C2R-Key"


def open_server(key: str) -> Any:
    """A ViserServer on a free loopback port that requires the key, with the share tunnel disabled."""
    import viser
    from viser import _messages

    _demand_key(key)
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    return server


def check() -> list[str]:
    """Violations of these assumptions by the installed viser; empty without any."""
    import inspect

    import viser
    from viser import _messages
    from viser.infra import _infra

    problems = []
    if viser.__version__ != VERSION:
        problems.append(f"viser {viser.__version__} found, {VERSION} expected")
    for name in ("ShareUrlRequest", "ShareUrlDisconnect"):
        if not hasattr(_messages, name):
            problems.append(f"viser._messages.{name} is gone: look for the new way to the share tunnel")
    if not hasattr(_infra.WebsockServer, "unregister_handler"):
        problems.append("WebsockServer.unregister_handler is gone")
    source = inspect.getsource(_infra)
    if "websockets.asyncio.server.serve(" not in source or "process_request=" not in source:
        problems.append("viser opens its port in another way: the key would not be asked for")
    return problems


def _demand_key(key: str) -> None:
    """Wrap viser's serve function to require the key, once per process."""
    original = websockets.asyncio.server.serve
    if getattr(original, "_demands_key", False):
        return

    def serve(*arguments: Any, process_request: Any = None, **options: Any) -> Any:
        def guarded(connection: Any, request: Request) -> Any:
            if request.headers.get(KEY_HEADER) != key:
                return Response(HTTPStatus.FORBIDDEN, "Forbidden", Headers({"Content-Length": "0", "Connection": "close"}), b"")
            return process_request(connection, request) if process_request is not None else None

        return original(*arguments, process_request=guarded, **options)

    serve._demands_key = True  # type: ignore[attr-defined]
    websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
