"""Who may talk to this app: Host and Origin checks, the session cookie, the custom header, and what pages may do.

Pure ASGI, so that it stands before uploads and sockets as well. The launch token is printed once and exchanged for a
cookie; the cookie is a random session id signed with a key kept in the data folder, so a restart keeps people in.
"""

import hashlib
import hmac
import json
import os
import secrets
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.errors import body

COOKIE = "r2c2r_session"
SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
OPEN_PATHS = ("/api/health", "/static/", "/favicon.ico")
PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; worker-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'"
)
NO_SESSION = "open the address that `r2c2r serve` printed: it carries the key to this app"


class Keys:
    """Signs and checks session cookies with a key kept in the data folder."""

    def __init__(self, data_dir: Path) -> None:
        self._secret = _kept_secret(data_dir / "session.key")

    def new_session(self) -> str:
        """The value of a new session's cookie."""
        session = secrets.token_urlsafe(16)
        return f"{session}.{self._signature(session)}"

    def session_of(self, cookie_header: str) -> str | None:
        """The session id of a request's cookies; None when there is none or it is not ours."""
        try:
            cookies = SimpleCookie(cookie_header)
        except CookieError:
            return None
        if COOKIE not in cookies:
            return None
        session, _, signature = cookies[COOKIE].value.partition(".")
        return session if hmac.compare_digest(signature.encode(), self._signature(session).encode()) else None

    def _signature(self, session: str) -> str:
        return hmac.new(self._secret, session.encode(), hashlib.sha256).hexdigest()


class Guard:
    """The middleware."""

    def __init__(self, app: ASGIApp, keys: Keys, allowed_hosts: tuple[str, ...]) -> None:
        self.app, self.keys, self.allowed_hosts = app, keys, allowed_hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse what may not pass; give the session to what may."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        session = self.keys.session_of(headers.get("cookie", ""))
        refusal = self._refusal(scope, headers, session)
        if refusal is not None:
            await _refuse(scope, receive, _with_safe_headers(send, scope), *refusal)
            return
        scope.setdefault("state", {})["session"] = session or ""
        await self.app(scope, receive, _with_safe_headers(send, scope) if scope["type"] == "http" else send)

    def _refusal(self, scope: Scope, headers: Headers, session: str | None) -> tuple[int, str, str, str] | None:
        """(status, kind, message, hint) of a request that may not pass."""
        host = headers.get("host", "")
        if _host_name(host) not in self.allowed_hosts:
            return 421, "forbidden", f"this app does not answer for host '{host[:80]}'", "use the address it printed"
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return 403, "forbidden", "the request comes from another site", "use the app's own pages"
        path, method = scope["path"], scope.get("method", "GET")
        if scope["type"] == "websocket":
            if origin is None:
                return 403, "forbidden", "a connection without an Origin is refused", "connect from the app's own pages"
        elif method not in SAFE_METHODS and "x-requested-with" not in headers:
            return 403, "forbidden", "the header X-Requested-With is missing", "send X-Requested-With: r2c2r"
        if session is None and not path.startswith(OPEN_PATHS) and not _brings_token(scope):
            return 401, "unauthorised", "no session", NO_SESSION
        return None


def _brings_token(scope: Scope) -> bool:
    page = scope["path"] == "/" or scope["path"].startswith("/p/")
    return (
        scope["type"] == "http"
        and page
        and b"token" in scope["query_string"]
        and "token" in parse_qs(scope["query_string"].decode("latin-1"))
    )


def _host_name(host: str) -> str:
    """The name of a Host header, without its port."""
    try:
        return (urlsplit(f"//{host}").hostname or "").lower()
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
    page = scope["path"] == "/" or scope["path"].startswith("/p/")
    content = f"{message}: {hint}\n".encode() if page else json.dumps(body(kind, message, hint)).encode()
    media_type = b"text/plain; charset=utf-8" if page else b"application/json"
    sizes = [(b"content-type", media_type), (b"content-length", str(len(content)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": sizes})
    await send({"type": "http.response.body", "body": content})


def _kept_secret(path: Path) -> bytes:
    try:
        found = path.read_bytes()
        if len(found) == 32:
            return found
    except FileNotFoundError:
        pass
    path.parent.mkdir(parents=True, exist_ok=True)
    secret = secrets.token_bytes(32)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    with os.fdopen(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as handle:
        handle.write(secret)
    temporary.replace(path)
    return secret
