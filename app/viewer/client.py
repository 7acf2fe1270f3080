"""The web process's end of the viewer: starts its process when somebody looks, asks it things, knows who may look."""

import queue
import secrets
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.errors import Forbidden, Unavailable
from app.process import Worker, python_module
from app.settings import Settings
from r2c2r_core.errors import InputError

ANSWER_S = 60.0
TOKEN_S = 12 * 3600.0
WORKER = python_module("app.viewer.worker")


@dataclass(slots=True)
class Grant:
    """Who may look at what through one token."""

    session: str
    project: str
    until: float


class Viewer:
    """All open 3D views. Every method may be called from any thread."""

    def __init__(self, settings: Settings, command: tuple[str, ...] = WORKER, *, enabled: bool = True) -> None:
        self.enabled = enabled
        self._settings, self._command = settings, command
        self.key = secrets.token_urlsafe(24)
        self._grants: dict[str, Grant] = {}
        self._ports: dict[str, int] = {}
        self._used: dict[str, float] = {}
        self._watching: dict[str, int] = {}
        self._worker: Worker | None = None
        self._lock = threading.Lock()
        self._number = 0

    def open(self, project: str, workdir: Path, session: str) -> str:
        """A token by which this session reaches the project's view; raises Unavailable when there is no viewer."""
        self._ports[project] = int(self._ask({"cmd": "open", "project": project, "workdir": str(workdir)})["port"])
        self._used[project] = time.monotonic()
        for token, grant in tuple(self._grants.items()):
            if grant.session == session and grant.project == project and grant.until > time.monotonic():
                return token
        token = secrets.token_urlsafe(16)
        self._grants[token] = Grant(session, project, time.monotonic() + TOKEN_S)
        return token

    def show(self, project: str, workdir: Path, wish: dict[str, Any]) -> dict[str, Any]:
        """Change what the view shows."""
        if project not in self._ports:
            self._ports[project] = int(self._ask({"cmd": "open", "project": project, "workdir": str(workdir)})["port"])
        return self._ask({"cmd": "show", "project": project, **wish})

    def move(self, project: str, values: dict[str, float]) -> dict[str, Any]:
        """Move joints of the shown scene."""
        return self._ask({"cmd": "joints", "project": project, "values": values})

    def port(self, token: str, session: str) -> int:
        """The loopback port behind a token; raises Forbidden for a token of somebody else, Unavailable when it is down."""
        grant = self._grants.get(token)
        if grant is None or grant.session != session or grant.until < time.monotonic():
            raise Forbidden("this 3D view belongs to another session or has expired", hint="open the review page again")
        self._used[grant.project] = time.monotonic()
        if grant.project not in self._ports or self._worker is None or not self._worker.alive:
            raise Unavailable("the 3D view is not running", hint="open the review page again")
        return self._ports[grant.project]

    def close(self, project: str, *, forget: bool = True) -> None:
        """Close a project's view; with `forget` its tokens are worth nothing any more."""
        for token in [token for token, grant in self._grants.items() if grant.project == project and forget]:
            del self._grants[token]
        if self._ports.pop(project, None) is not None:
            try:
                self._ask({"cmd": "close", "project": project})
            except (Unavailable, InputError):
                return

    def close_idle(self) -> None:
        """Close views that nobody has looked at for a while."""
        limit = time.monotonic() - self._settings.viewer_idle_s
        for project in [p for p, used in self._used.items() if used < limit and not self._watching.get(p)]:
            self._used.pop(project)
            self.close(project, forget=False)

    @contextmanager
    def watched(self, token: str) -> Iterator[None]:
        """Keep the view behind the token open while somebody is connected."""
        project = self._grants[token].project
        self._watching[project] = self._watching.get(project, 0) + 1
        try:
            yield
        finally:
            self._watching[project] -= 1
            self._used[project] = time.monotonic()

    def stop(self) -> None:
        """End the process."""
        with self._lock:
            if self._worker is not None:
                self._worker.kill()
                self._worker.close()
                self._worker = None

    def _ask(self, command: dict[str, Any]) -> dict[str, Any]:
        with self._lock:
            worker = self._running()
            self._number += 1
            if not worker.say({"id": self._number, **command}):
                raise self._down()
            answer = self._answer(worker)
        if "error" in answer:
            error = answer["error"]
            raise (Unavailable if error["kind"] == "internal" else InputError)(error["message"], hint=error["hint"])
        result: dict[str, Any] = answer["ok"]
        return result

    def _answer(self, worker: Worker) -> dict[str, Any]:
        deadline = time.monotonic() + ANSWER_S
        while time.monotonic() < deadline:
            try:
                line = worker.next_line(timeout=deadline - time.monotonic())
            except queue.Empty:
                break
            if line is None:
                self._forget(worker)
                raise self._down()
            if line.get("id") == self._number:
                return line
        self._forget(worker)
        raise self._down()

    def _forget(self, worker: Worker) -> None:
        worker.kill()
        worker.close()
        self._worker = None
        self._ports.clear()

    def _running(self) -> Worker:
        if not self.enabled:
            raise Unavailable("the 3D view is switched off", hint="see the picture and the mesh instead")
        if self._worker is not None and not self._worker.alive:
            self._forget(self._worker)
        if self._worker is None:
            self._worker = Worker(self._command, self._settings.data_dir / "logs" / "viewer.log")
            self._worker.say({"key": self.key})
        return self._worker

    def _down(self) -> Unavailable:
        return Unavailable("the 3D view has stopped", hint="try again: it starts anew; its log is logs/viewer.log")
