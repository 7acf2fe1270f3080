"""Middleware that validates paths and query values: length limits and encodable text.

Pages, API and sockets have absolute addresses, so a proxy that serves the app below a path is reported at once.
"""

from urllib.parse import parse_qsl

from fastapi.responses import JSONResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from app.errors import body
from app.schemas.text import LONGEST_FILE_NAME
from r2c2r_core.texts import OBEYED

LONGEST_VALUE = 4096  # characters after a `name=`: a path on the server's machine


class Addresses:
    """The middleware: 404 for an impossible path, 422 for an impossible value."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse invalid addresses; pass on the others."""
        refused = _refused(scope) if scope["type"] == "http" else None
        await (refused or self.app)(scope, receive, send)


def _refused(scope: Scope) -> JSONResponse | None:
    path: str = scope["path"]
    prefix = dict(scope["headers"]).get(b"x-forwarded-prefix", b"").decode("latin-1").rstrip("/")
    if prefix:
        message = f"a proxy publishes this server below the path {prefix[:80]!a}, where its pages are not found"
        return JSONResponse(body("invalid", message, "give it a host name of its own, such as r2c2r.example"), 421)
    if OBEYED.search(path) or any(len(part.encode()) > LONGEST_FILE_NAME for part in path.split("/")):
        return JSONResponse(body("not-found", "there is nothing at this address", "check the address"), 404)
    for name, value in parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True):
        if OBEYED.search(value) or len(value) > LONGEST_VALUE:
            message = f"{name[:60]!a}: it holds characters that cannot be shown, or more than {LONGEST_VALUE} characters"
            return JSONResponse(body("invalid", message, "write it without"), 422)
    return None
