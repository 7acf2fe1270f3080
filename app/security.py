"""Who may talk to this app: Host and Origin checks, the session cookie, the custom header, and what pages may do.

Pure ASGI, so that it stands before uploads and sockets as well. The cookie is a random session id; whose it is, the
database knows (app.services.people), so a restart keeps people in and signing out works at once.
"""

import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Literal
from urllib.parse import parse_qs, quote, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.errors import body, kind_of
from r2c2r_core.errors import R2C2RError

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
OPEN_PATHS = ("/api/health", "/api/login", "/login", "/static/", "/favicon.ico")
Role = Literal["annotator", "reviewer", "admin"]
Refusal = tuple[int, str, str, str]  # status, kind, message, hint
ROLES: tuple[Role, ...] = ("annotator", "reviewer", "admin")  # each may do what those before it may
TLS_POLICY = "max-age=31536000"  # a year: a browser that came by TLS never again comes without
FEATURE_POLICY = "camera=(), microphone=(), geolocation=(), payment=(), usb=(), serial=(), bluetooth=(), display-capture=()"
PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; worker-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'"
)
SESSION_ENDED = 4401  # closes a WebSocket whose session has ended; HTTP says 401
NO_SESSION = "sign in, or open the address that `r2c2r serve` printed: it carries the key to this app"


@dataclass(frozen=True, slots=True)
class Person:
    """Who asks."""

    name: str
    role: Role
    account: bool = False  # named; else whoever started the server

    def may(self, needed: Role) -> bool:
        """Whether this person's role reaches as far as the needed one."""
        return ROLES.index(self.role) >= ROLES.index(needed)


def cookie_name(scope: Scope) -> str:
    """What the session's cookie is called: browsers send a host's cookies to each of its ports, so it says which is ours."""
    server = scope.get("server")
    return f"r2c2r_session_{server[1]}" if server else "r2c2r_session"


def session_in(scope: Scope, cookie_header: str) -> str:
    """The session id of a request's cookies; empty when there is none."""
    return cookie_parser(cookie_header).get(
        cookie_name(scope), ""
    )  # other apps of this machine may have set anything beside it


class Guard:
    """The middleware."""

    def __init__(
        self, app: ASGIApp, person_of: Callable[[str], Awaitable[Person | None]], allowed_hosts: tuple[str, ...]
    ) -> None:
        self.app, self.person_of, self.allowed_hosts = app, person_of, allowed_hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse what may not pass; say whose request it is to what may."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        session = session_in(scope, headers.get("cookie", ""))
        refusal, person = self._foreign(scope, headers), None
        if refusal is None and not scope["path"].startswith(OPEN_PATHS):
            person, refusal = await self._enter(scope, session)
        if refusal is not None:
            await _refuse(scope, receive, _with_safe_headers(send, scope), *refusal)
            return
        scope.setdefault("state", {}).update(session=session if person else "", person=person)
        await self.app(scope, receive, _with_safe_headers(send, scope) if scope["type"] == "http" else send)

    async def _enter(self, scope: Scope, session: str) -> tuple[Person | None, Refusal | None]:
        """Whose request it is, or why nobody in particular may ask that."""
        try:
            person = await self.person_of(session) if session else None
        except R2C2RError as error:  # the database does not answer
            kind, status = kind_of(error)
            return None, (status, kind, error.message, error.hint)
        if person is None and not _brings_token(scope):
            return None, (401, "unauthorised", "no session", NO_SESSION)
        return person, None

    def _foreign(self, scope: Scope, headers: Headers) -> Refusal | None:
        """Why a request does not come from our own pages, or not to us."""
        host = headers.get("host", "")
        if _host_name(host) not in self.allowed_hosts:
            return 421, "forbidden", f"this app does not answer for host '{host[:80]}'", "use the address it printed"
        origin = headers.get("origin")
        if origin is not None and _network_location(origin) != host:
            return 403, "forbidden", "the request comes from another site", "use the app's own pages"
        if scope["type"] == "websocket":
            if origin is None:
                return 403, "forbidden", "a connection without an Origin is refused", "connect from the app's own pages"
        elif scope["method"] not in SAFE_METHODS and "x-requested-with" not in headers:
            return 403, "forbidden", "the header X-Requested-With is missing", "send X-Requested-With: r2c2r"
        return None


def _brings_token(scope: Scope) -> bool:
    return (
        scope["type"] == "http"
        and _is_page(scope)
        and b"token" in scope["query_string"]
        and "token" in parse_qs(scope["query_string"].decode("latin-1"))
    )


def _host_name(host: str) -> str:
    """The name of a Host header, without its port."""
    try:
        return (urlsplit(f"//{host}").hostname or "").lower()
    except ValueError:
        return ""


def _network_location(origin: str) -> str:
    """Host and port of an Origin header; empty when it has none."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def _with_safe_headers(send: Send, scope: Scope) -> Send:
    viewer = scope["path"].startswith("/viewer/")

    async def guarded(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.setdefault("x-content-type-options", "nosniff")
            headers.setdefault("referrer-policy", "same-origin")
            headers.setdefault("x-frame-options", "SAMEORIGIN")
            headers.setdefault("cross-origin-opener-policy", "same-origin")
            headers.setdefault("cross-origin-resource-policy", "same-origin")
            headers.setdefault("permissions-policy", FEATURE_POLICY)
            if scope.get("scheme") == "https":
                headers.setdefault("strict-transport-security", TLS_POLICY)
            if not viewer:
                headers.setdefault("content-security-policy", PAGE_POLICY)
            if scope["path"].startswith("/api/"):
                headers.setdefault("cache-control", "no-store")
        await send(message)

    return guarded


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, kind: str, message: str, hint: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 4000 + status, "reason": message[:100]})
        return
    content = json.dumps(body(kind, message, hint)).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(content)).encode())]
    if status == 401 and _is_page(scope):
        status = 303
        query = scope["query_string"].decode("latin-1")
        wanted = f"{scope['path']}?{query}" if query else scope["path"]
        headers.append((b"location", f"/login?next={quote(wanted)}".encode()))
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": content})


def _is_page(scope: Scope) -> bool:
    return scope["path"] in ("/", "/people") or scope["path"].startswith("/p/")
