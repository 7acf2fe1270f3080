"""Bounded, repeatable and cancellable HTTP requests to a generator that may be slow, unreachable or faulty."""

import contextlib
import http.client
import json
import socket
import ssl
import threading
import time
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from r2c2r_core.errors import BackendUnavailable, GenerationFailed
from r2c2r_core.progress import SILENT, Progress

MOST_BYTES = 200_000_000  # limit of a response: ten times the largest GLB that TRELLIS returns
_PASSING = (429, 502, 503, 504)  # transient states
_POLL_S = 0.2  # interval at which a cancellation is noticed


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """Timeouts and number of attempts."""

    connect_s: float = 10.0
    answer_s: float = 900.0  # a textured sample takes 20 s to some minutes, and it may wait behind others
    leave_s: float = 3.0  # to cancel a job on the server whose result is no longer needed
    tries: int = 4
    first_wait_s: float = 1.0  # doubled after every try


class _NoAnswer(TimeoutError):
    """Response timeout of a server that accepted the connection."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Endpoint:
    """A server with its token and timeouts."""

    url: str  # http(s)://host[:port][/path]
    token: str = ""
    patience: Patience = field(default_factory=Patience)

    def __post_init__(self) -> None:
        parts = urlsplit(self.url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise BackendUnavailable(
                f"'{self.url}' is not the address of a generator",
                hint="set generate.url to http://host:port/v1/mesh or http://host:port/v1/infer",
            )
        if parts.username or parts.password:
            raise BackendUnavailable(
                "generate.url holds a password", hint="give a token in R2C2R_GENERATOR_TOKEN instead: settings are exported"
            )

    @property
    def where(self) -> str:
        """Host and port, for a person."""
        return urlsplit(self.url).netloc


def ask(
    endpoint: Endpoint,
    method: str,
    path: str,
    body: bytes | None = None,
    content_type: str = "application/json",
    *,
    progress: Progress = SILENT,
) -> bytes:
    """The body of a successful response.

    Transient failures are retried with exponential back-off. Raises BackendUnavailable when the server cannot be used at all
    (unreachable, wrong token, wrong path), GenerationFailed when it refuses or fails on this request, Cancelled on request.
    """
    patience = endpoint.patience
    wait = patience.first_wait_s
    for attempt in range(patience.tries):
        last = attempt == patience.tries - 1
        try:
            status, content, retry_after = _once(endpoint, method, path, body, content_type, progress)
        except _NoAnswer as error:
            raise BackendUnavailable(
                f"generator at {endpoint.where} gave no answer in {patience.answer_s:.0f} s", hint="see its log"
            ) from error
        except (OSError, http.client.HTTPException) as error:
            if last or isinstance(error, ssl.SSLError):
                raise BackendUnavailable(
                    f"generator at {endpoint.where} cannot be reached ({_reason(error)})",
                    hint="start it, or correct generate.url",
                ) from error
        else:
            if status not in _PASSING or last:
                return _judged(endpoint, path, status, content)
            wait = max(wait, min(retry_after, 30.0))
        _pause(wait, progress)
        wait *= 2
    raise AssertionError("unreachable: the last try returns or raises")


def ask_json(
    endpoint: Endpoint, method: str, path: str, document: Any = None, *, progress: Progress = SILENT
) -> dict[str, Any]:
    """The JSON object of a successful response; raises as `ask` does."""
    body = None if document is None else json.dumps(document).encode()
    return json_object(endpoint, ask(endpoint, method, path, body, progress=progress))


def json_object(endpoint: Endpoint, content: bytes) -> dict[str, Any]:
    """The JSON object in a response body; raises GenerationFailed if there is none."""
    try:
        answer = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise GenerationFailed(f"generator at {endpoint.where}: its answer is not JSON") from error
    if not isinstance(answer, dict):
        raise GenerationFailed(f"generator at {endpoint.where}: a JSON object expected, found {type(answer).__name__}")
    return answer


def _once(
    endpoint: Endpoint, method: str, path: str, body: bytes | None, content_type: str, progress: Progress
) -> tuple[int, bytes, float]:
    """Status, body and Retry-After of one request, which runs in its own thread so that it can be cancelled."""
    connection, opened = _connection(endpoint), list[socket.socket]()
    outcome: list[tuple[int, bytes, float] | BaseException] = []

    def talk() -> None:
        try:
            connection.connect()
            opened.append(connection.sock)  # the connection itself forgets it once the answer begins
            connection.sock.settimeout(endpoint.patience.answer_s)
            headers = {"Content-Type": content_type, "Accept": "*/*", "Connection": "close"}
            if endpoint.token:
                headers["Authorization"] = f"Bearer {endpoint.token}"
            connection.request(method, path, body, headers)
            with connection.getresponse() as response:
                outcome.append((response.status, _bounded(response), _seconds(response.headers.get("Retry-After"))))
        except BaseException as error:  # passed unchanged to the waiting thread
            outcome.append(error)
        finally:
            connection.close()

    thread = threading.Thread(target=talk, daemon=True)
    thread.start()
    deadline = time.monotonic() + endpoint.patience.connect_s + endpoint.patience.answer_s
    try:
        while thread.is_alive():
            progress.check()
            if time.monotonic() > deadline:  # a server that drips a byte at a time never trips the socket's timeout
                raise _NoAnswer
            thread.join(_POLL_S)
    finally:
        _hang_up(opened)
        thread.join(2.0)
    if isinstance(outcome[0], TimeoutError) and opened:
        raise _NoAnswer from outcome[0]
    if isinstance(outcome[0], BaseException):
        raise outcome[0]
    return outcome[0]


def _connection(endpoint: Endpoint) -> http.client.HTTPConnection:
    parts = urlsplit(endpoint.url)
    make = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
    return make(parts.hostname or "", parts.port, timeout=endpoint.patience.connect_s)


def _hang_up(opened: list[socket.socket]) -> None:
    """Shut the connection down, even while a thread reads from it: that thread then finds it closed."""
    for connection in opened:
        with contextlib.suppress(OSError):  # closed already
            connection.shutdown(socket.SHUT_RDWR)


def _bounded(response: http.client.HTTPResponse) -> bytes:
    content = response.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise GenerationFailed(f"the generator's answer is over {MOST_BYTES // 1_000_000} MB", hint="ask it for a smaller mesh")
    return content


def _judged(endpoint: Endpoint, path: str, status: int, content: bytes) -> bytes:
    """The body of a successful response; raises the failure that the status means."""
    if 200 <= status < 300:
        return content
    said = _said(content)
    if status in (401, 403):
        raise BackendUnavailable(
            f"generator at {endpoint.where} refused the token ({status})", hint="set R2C2R_GENERATOR_TOKEN to its token"
        )
    if status in (404, 405) or 300 <= status < 400:
        raise BackendUnavailable(
            f"generator at {endpoint.where} has no {path} ({status})", hint="correct generate.url: …/v1/mesh or …/v1/infer"
        )
    if status in _PASSING:
        raise BackendUnavailable(f"generator at {endpoint.where} is busy or down ({status}){said}", hint="try again later")
    raise GenerationFailed(f"generator at {endpoint.where} answered {status}{said}")


def _said(content: bytes) -> str:
    """The server's failure message on one short line."""
    text = " ".join(content[:2000].decode(errors="replace").split())
    return f": {text[:200]}" if text else ""


def _pause(seconds: float, progress: Progress) -> None:
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        progress.check()
        time.sleep(min(left, _POLL_S))


def _seconds(retry_after: str | None) -> float:
    return float(retry_after) if retry_after is not None and retry_after.isdigit() else 0.0


def _reason(error: Exception) -> str:
    return (str(error) or type(error).__name__).splitlines()[0]
