"""Access control: Host and Origin checks, session cookie, custom header, and content security policy.

Pure ASGI, so that it also covers uploads and sockets. The cookie is a random session id, mapped to a user in the database
(app.services.people), so sessions survive a restart and signing out takes effect at once.
"""

import json
import logging
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal
from urllib.parse import parse_qs, quote, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from app.errors import body, kind_of
from r2c2r_core.errors import R2C2RError

_log = logging.getLogger(__name__)

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
OPEN_PATHS = ("/healthz", "/readyz", "/api/health", "/api/login", "/login", "/static/", "/favicon.ico")
Role = Literal["annotator", "reviewer", "admin"]
TokenScope = Literal["metrics", "read", "annotator", "reviewer", "admin"]  # scope of a token
Refusal = tuple[int, str, str, str]  # status, kind, message, hint
ROLES: tuple[Role, ...] = ("annotator", "reviewer", "admin")  # in ascending order of rights
TOKEN_PREFIX = "r2c2r_"  # identifies leaked tokens
TLS_POLICY = "max-age=31536000"  # a year: a browser that has used TLS always uses it
FEATURE_POLICY = "camera=(), microphone=(), geolocation=(), payment=(), usb=(), serial=(), bluetooth=(), display-capture=()"
PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; worker-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'"
)
SESSION_ENDED = 4401  # closes a WebSocket whose session has ended; HTTP says 401
NO_SESSION = "sign in, or open the address that `r2c2r serve` printed: it carries the key to this app"


@dataclass(frozen=True, slots=True)
class Person:
    """The user of a request."""

    name: str
    role: Role
    account: bool = False  # a named account; else the user who started the server
    scope: TokenScope | None = None  # of the token with which a program acts for the user

    def may(self, needed: Role) -> bool:
        """Whether this user's role includes the needed one."""
        return ROLES.index(self.role) >= ROLES.index(needed)


def cookie_name(scope: Scope) -> str:
    """Name of the session cookie, which includes the port, as browsers send a host's cookies to all its ports.

    This is the port seen by the browser: servers behind one address share its sessions, regardless of their own ports.
    """
    port = Headers(scope=scope).get("host", "").rpartition(":")[2]
    return f"r2c2r_session_{port}" if port.isdecimal() else "r2c2r_session"


def session_in(scope: Scope, cookie_header: str) -> str:
    """The session id in a request's cookies; empty when there is none."""
    return cookie_parser(cookie_header).get(cookie_name(scope), "")  # other apps of this machine may have set other cookies


class BehindProxies:
    """Middleware that takes client address and scheme from trusted proxies, and records that the peer was one of them."""

    def __init__(self, app: ASGIApp, trusted: Sequence[str]) -> None:
        self.believing: Any = ProxyHeadersMiddleware(app, list(trusted))  # type: ignore[arg-type]  # uvicorn's name of the type

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on with the proxy's client information."""
        peer = scope.get("client")
        scope.setdefault("state", {})["proxied"] = peer is not None and peer[0] in self.believing.trusted_hosts
        await self.believing(scope, receive, send)


class Guard:
    """Access-control middleware. `session_of` gives the session of a user named by a trusted proxy in the header `named_in`."""

    def __init__(
        self,
        app: ASGIApp,
        person_of: Callable[[str], Awaitable[Person | None]],
        allowed_hosts: tuple[str, ...],
        named_in: str,
        session_of: Callable[[str, str], Awaitable[str]],
    ) -> None:
        self.app, self.person_of, self.allowed_hosts = app, person_of, allowed_hosts
        self.named_in, self.session_of = named_in, session_of

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse unauthorised requests; attach the user to the others."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        token = _bearer(headers)
        session = token or session_in(scope, headers.get("cookie", ""))
        named = headers.getlist(self.named_in) if self.named_in else []
        refusal, person = self._foreign(scope, headers, by_token=bool(token)) or self._misnamed(scope, named), None
        if refusal is None and not scope["path"].startswith(OPEN_PATHS):
            session, person, refusal = await self._enter(scope, session, "" if token else "".join(named))
        if refusal is not None:
            await _refuse(scope, receive, _with_safe_headers(send, scope), *refusal)
            return
        scope.setdefault("state", {}).update(session=session if person else "", person=person)
        await self.app(scope, receive, _with_safe_headers(send, scope) if scope["type"] == "http" else send)

    async def _enter(self, scope: Scope, session: str, named: str) -> tuple[str, Person | None, Refusal | None]:
        """Session and user of a request, or the reason for refusing an anonymous one."""
        try:
            session = await self.session_of(named, _client(scope)) if named else session
            person = await self.person_of(session) if session else None
        except R2C2RError as error:  # the database does not answer, or the proxy names no user
            kind, status = kind_of(error)
            return session, None, (status, kind, error.message, error.hint)
        if person is None and not _brings_token(scope):
            return session, None, (401, "unauthorised", "no session", NO_SESSION)
        if person is not None and not _reaches(person, scope):
            said = f"this token allows only {person.scope}"
            return session, None, (403, "forbidden", said, "make another token: r2c2r token add")
        return session, person, None

    def _misnamed(self, scope: Scope, named: Sequence[str]) -> Refusal | None:
        """Reason to reject the user header, which must come only from a trusted proxy; None if it is valid."""
        if named and not scope.get("state", {}).get("proxied"):
            _log.warning("%s from %s, which is no trusted proxy: refused", self.named_in, _client(scope))
            said = f"{self.named_in} is accepted only from trusted proxies, and this request came from {_client(scope)}"
            return 403, "forbidden", said, "open the proxy's address; R2C2R_TRUSTED_PROXIES lists the trusted proxies"
        if len(named) > 1:
            _log.warning("%s twice in a request that a trusted proxy passed on: refused", self.named_in)
            return (
                403,
                "forbidden",
                f"{self.named_in} occurs twice in the request",
                "the proxy must replace the header, not add a second one",
            )
        return None

    def _foreign(self, scope: Scope, headers: Headers, *, by_token: bool) -> Refusal | None:
        """Reason to reject a cross-site or misaddressed request; token requests are exempt, as no page can forge them."""
        host = headers.get("host", "")
        if _host_name(host) not in self.allowed_hosts:
            return 421, "forbidden", f"this app does not answer for host '{host[:80]}'", "use the address it printed"
        origin = headers.get("origin")
        if origin is not None and _network_location(origin) != host:
            return 403, "forbidden", "the request comes from another site", "use the app's own pages"
        if scope["type"] == "websocket":
            if origin is None and not by_token:
                return 403, "forbidden", "a connection without an Origin is refused", "connect from the app's own pages"
        elif scope["method"] not in SAFE_METHODS and "x-requested-with" not in headers and not by_token:
            return 403, "forbidden", "the header X-Requested-With is missing", "send X-Requested-With: r2c2r"
        return None


def _client(scope: Scope) -> str:
    """Client address, as reported by trusted proxies."""
    client = scope.get("client")
    return str(client[0]) if client else ""


def _bearer(headers: Headers) -> str:
    """The bearer token of a request; empty when there is none."""
    kind, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if kind.lower() == "bearer" and token.strip().startswith(TOKEN_PREFIX) else ""


def _reaches(person: Person, scope: Scope) -> bool:
    """Whether the scope of the user's token permits the request."""
    if person.scope == "metrics":
        return bool(scope["path"] == "/metrics")
    return person.scope != "read" or (scope["type"] == "http" and scope["method"] in SAFE_METHODS)


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
