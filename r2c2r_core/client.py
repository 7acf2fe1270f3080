"""Client of a server: upload a recording, click, run, wait, download, with an API token and the standard library.

    server = Server("https://kitchens.example", token)
    project = server.upload(Path("kitchen.r3d"))
    server.wait(project)
    server.click(project, json.loads(Path("prompts.json").read_text()))
    server.run(project)
    server.wait(project)
    server.download(project, Path("kitchen.zip"))

A change whose answer is lost is sent again under the same Idempotency-Key, and is applied once.
"""

import contextlib
import http.client
import json
import os
import secrets
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

from r2c2r_core.disk import explained_io
from r2c2r_core.errors import EnvironmentProblem, InputError, R2C2RError, StageError
from r2c2r_core.progress import SILENT, Progress

T = TypeVar("T")

PIECE_BYTES = 8 * 2**20  # upload piece: the amount lost when a connection breaks
TIMEOUT_S = 120.0  # without receiving a byte; a server examines a recording before it answers
TRIES = 5  # for transient failures: no connection, 429, 502, 503, 504
PAUSE_S = 1.0  # before the second try, doubled each time
ASK_EVERY_S = 1.0
ENDED = ("done", "failed", "cancelled")
_PASSING = (429, 502, 503, 504)


class Refused(R2C2RError):
    """The server refused the request; `status` is HTTP's, `current` the server's current value on a conflict."""

    def __init__(self, message: str, *, hint: str, status: int = 500, current: Any = None) -> None:
        super().__init__(message, hint=hint)
        self.status, self.current = status, current
        self.exit_code = 2 if status < 500 and status != 409 else 1


class _Answer(Protocol):
    def read(self, amount: int = -1, /) -> bytes: ...


class Server:
    """One server; raises Refused for refused requests, EnvironmentProblem when it does not answer."""

    def __init__(self, address: str, token: str) -> None:
        parts = urllib.parse.urlsplit(address)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise InputError(f"{address[:80]!r}: not a server's address", hint="use one such as https://kitchens.example")
        if not token.isascii() or not token.isprintable() or not token:
            raise InputError("not a valid token", hint="create one on the server's machine: r2c2r token add NAME")
        self.address = f"{parts.scheme}://{parts.netloc}"
        self._token = token
        self._opener = urllib.request.build_opener(_OwnHostOnly)

    def projects(self) -> list[dict[str, Any]]:
        """The projects visible to the token's user, most recently changed first."""
        found: list[dict[str, Any]] = self._json("GET", "/api/projects")
        return found

    def upload(self, recording: Path, name: str | None = None, progress: Progress = SILENT) -> str:
        """Upload a recording or a project's file as a new project and return its id; resumes an interrupted upload."""
        with explained_io(recording):
            facts = recording.stat()
        about = {"file_name": recording.name, "size": facts.st_size, "name": name, "modified": facts.st_mtime}
        begun = self._begun(about) or self._json("POST", "/api/uploads", about)
        where, at = f"/api/uploads/{begun['id']}", int(begun["offset"])
        with explained_io(recording), recording.open("rb") as handle:
            while at < facts.st_size:
                handle.seek(at)
                at = self._send_piece(where, at, handle.read(PIECE_BYTES))
                progress.for_stage("upload").at(at / facts.st_size, recording.name)
        return str(self._json("POST", f"{where}/finish")["id"])

    def click(self, project: str, prompts: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Add the objects of a prompts.json; clicks of an existing object with the same name are replaced."""
        found: list[dict[str, Any]] = self._json("POST", f"{_of(project)}/prompts.json", dict(prompts))
        return found

    def run(self, project: str, *, seed: int = 0, **tools: str) -> int:
        """Start a reconstruction of the project's current state and return the job's number. `tools` are backends by seam."""
        return int(self._json("POST", f"{_of(project)}/run", {"seed": seed, **tools})["id"])

    def wait(self, project: str, progress: Progress = SILENT) -> dict[str, Any]:
        """Wait for the project's newest job and return it; raises StageError with the server's reason if it failed."""
        asked = urllib.parse.urlencode({"project": project, "limit": 1})
        while True:
            jobs = self._json("GET", f"/api/jobs?{asked}")
            if not jobs:
                raise InputError(f"{project}: no job", hint="start one: r2c2r remote run PROJECT")
            job: dict[str, Any] = jobs[0]
            if job["state"] == "done":
                return job
            if job["state"] in ENDED:
                said = job["error"] or {"message": job["message"], "hint": ""}
                raise StageError(f"job {job['id']} is {job['state']}: {said['message']}", hint=said["hint"])
            progress.for_stage(job["stage"] or job["state"]).at(job["progress"], job["message"])
            time.sleep(ASK_EVERY_S)

    def download(self, project: str, destination: Path, version: int | None = None, progress: Progress = SILENT) -> int:
        """Write a version of the bundle atomically, by default the newest, and return its number."""
        found = {bundle["version"]: bundle for bundle in self._json("GET", f"{_of(project)}/bundles")}
        version = max(found, default=0) if version is None else version
        if version not in found:
            raise InputError(f"{project}: no bundle {version or ''}".rstrip(), hint="run it first: r2c2r remote run PROJECT")
        self._fetch(f"{_media(project)}/bundles/{version}.zip", destination, found[version]["size"], progress)
        return version

    def export(self, project: str, destination: Path, *, recording: bool = False, progress: Progress = SILENT) -> None:
        """Write the project atomically as one file, from which `upload` to another server makes a project."""
        asked = urllib.parse.urlencode({"recording": "true" if recording else "false"})
        self._fetch(f"{_media(project)}/project.zip?{asked}", destination, None, progress)

    def _fetch(self, path: str, destination: Path, size: int | None, progress: Progress) -> None:
        """Write the content at the path; `size` in bytes where known beforehand."""
        part, wanted = destination.with_name(f"{destination.name}.part"), progress.for_stage("download")
        try:
            self._ask("GET", path, lambda answer: _write(answer, part, size, wanted))
            with explained_io(destination):
                os.replace(part, destination)
        finally:
            part.unlink(missing_ok=True)

    def _begun(self, about: Mapping[str, Any]) -> dict[str, Any] | None:
        """An unfinished upload of the same file, or None."""
        same = ("file_name", "size", "modified")
        unfinished = self._json("GET", "/api/uploads")
        return next((each for each in unfinished if all(each[key] == about[key] for key in same)), None)

    def _send_piece(self, where: str, at: int, piece: bytes) -> int:
        """Send a piece and return the new offset; on a mismatch, the offset at which the server continues."""
        try:
            headers = {"Upload-Offset": str(at), "Content-Type": "application/offset+octet-stream"}
            self._ask("PATCH", where, _all, piece, headers)
            return at + len(piece)
        except Refused as error:
            if error.status == 409 and isinstance(error.current, int):
                return error.current
            raise

    def _json(self, method: str, path: str, body: Any = None) -> Any:
        headers = {"Content-Type": "application/json"} if body is not None else {}
        content = json.dumps(body).encode() if body is not None else b"" if method == "POST" else None
        return _decoded(self._ask(method, path, _all, content, headers), path)

    def _ask(
        self,
        method: str,
        path: str,
        take: Callable[[_Answer], T],
        content: bytes | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> T:
        """Result of `take` on the answer, with retries of transient failures."""
        given = {"Authorization": f"Bearer {self._token}", "User-Agent": "r2c2r", **(headers or {})}
        if method == "POST":
            given["Idempotency-Key"] = secrets.token_urlsafe(24)
        for attempt in range(TRIES):
            request = urllib.request.Request(self.address + path, content, given, method=method)
            try:
                with self._opener.open(request, timeout=TIMEOUT_S) as answer:
                    return take(answer)
            except urllib.error.HTTPError as error:
                refused = _refusal(error)
                if error.code not in _PASSING or attempt == TRIES - 1:
                    raise refused from error
            except (OSError, http.client.HTTPException) as error:  # URLError is an OSError
                if attempt == TRIES - 1:
                    reason = getattr(error, "reason", error)
                    raise EnvironmentProblem(f"{self.address}: no answer ({reason})", hint="check the address") from error
            time.sleep(PAUSE_S * 2**attempt)
        raise AssertionError("the last try returns or raises")


class _OwnHostOnly(urllib.request.HTTPRedirectHandler):
    """Drops the token on redirects to another host, e.g. of a bundle at a pre-signed address."""

    def redirect_request(self, req: Any, fp: Any, code: int, msg: str, headers: Any, newurl: str) -> Any:
        """The redirected request."""
        further = super().redirect_request(req, fp, code, msg, headers, newurl)
        if further is not None and urllib.parse.urlsplit(newurl)[:2] != urllib.parse.urlsplit(req.full_url)[:2]:
            further.remove_header("Authorization")
        return further


def _of(project: str) -> str:
    return f"/api/projects/{urllib.parse.quote(project, safe='')}"


def _media(project: str) -> str:
    return f"/media/{urllib.parse.quote(project, safe='')}"


def _refusal(error: urllib.error.HTTPError) -> Refused:
    """The Refused error of a response, with the server's own message, or a generic one for a proxy's response."""
    said: Any = None
    with contextlib.suppress(ValueError, OSError), error:
        said = json.loads(error.read(2**16))
    if not isinstance(said, dict) or "message" not in said:
        return Refused(f"{error.url}: {error.code} {error.reason}", hint="is r2c2r at this address?", status=error.code)
    return Refused(str(said["message"]), hint=str(said.get("hint", "")), status=error.code, current=said.get("current"))


def _decoded(content: bytes, path: str) -> Any:
    try:
        return json.loads(content)
    except ValueError as error:
        raise EnvironmentProblem(f"{path}: the response is not from r2c2r", hint="is r2c2r at this address?") from error


def _all(answer: _Answer) -> bytes:
    return answer.read()


def _write(answer: _Answer, part: Path, size: int | None, progress: Progress) -> None:
    """Write the complete answer; a truncated one raises OSError, like a broken connection."""
    at = 0
    with explained_io(part):
        handle = part.open("wb")
    with handle:
        while piece := answer.read(2**20):
            with explained_io(part):
                handle.write(piece)
            at += len(piece)
            progress.at(at / max(size, at) if size else 0.0, part.stem)
    if size is not None and at != size:
        raise ConnectionError(f"{at} of {size} bytes arrived")
