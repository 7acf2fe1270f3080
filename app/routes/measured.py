"""Middleware that gives every request an id, a log line and a duration in the metrics."""

import logging
import re
import secrets
import time

from opentelemetry.trace import get_current_span
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.logs import REQUEST
from app.metrics import Metrics

_log = logging.getLogger(__name__)
_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
_METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")


class Measured:
    """The outermost middleware. A proxy's X-Request-ID is kept, so that both logs use the same id."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self.app, self.metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle the request and record its outcome; status 0 if the answer never began."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        given = Headers(scope=scope).get("x-request-id", "")
        request = given if _ID.fullmatch(given) else secrets.token_hex(8)
        began, status = time.perf_counter(), 0

        async def noted(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)["x-request-id"] = request
            await send(message)

        token = REQUEST.set(request)
        get_current_span().set_attribute("request", request)
        try:
            await self.app(scope, receive, noted)
        finally:
            self._note(scope, status, time.perf_counter() - began)
            REQUEST.reset(token)

    def _note(self, scope: Scope, status: int, seconds: float) -> None:
        method = scope["method"] if scope["method"] in _METHODS else "other"
        route = _route(scope)
        self.metrics.requests.observe(seconds, method, route, str(status))
        person = scope.get("state", {}).get("person")
        facts = {"method": method, "route": route, "status": status, "ms": round(1000 * seconds, 1)}
        _log.info("%s %s: %d", method, route, status, extra={**facts, "who": person.name if person else ""})


def _route(scope: Scope) -> str:
    """The route's path pattern, which bounds the number of metric labels."""
    found = getattr(scope.get("route"), "path", None)
    if found is not None:
        return str(found)
    return "/static" if scope["path"].startswith("/static/") else "other"
