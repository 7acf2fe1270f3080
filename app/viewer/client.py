"""Client of the viewer process: starts it on demand, sends commands, and checks access to views.

Each session has its own view of each project, independent of other users' views.
"""

import hashlib
import itertools
import queue
import secrets
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app.errors import Forbidden, NotReady, TooMany, Unavailable
from app.process import Line, Worker, python_module
from app.settings import Settings
from r2c2r_core.errors import InputError, R2C2RError

TOKEN_S = 12 * 3600.0
MOST_VIEWS = 24  # each keeps its content in memory
MOST_CONNECTIONS = 12  # concurrent ones of one user: a tab has one, and one more while it reconnects
WORKER = python_module("app.viewer.worker")


class _Closed(InputError):
    """The view is not open."""


_FAILURES: dict[str, type[R2C2RError]] = {  # otherwise the command is invalid
    "internal": Unavailable,
    "NotOpen": _Closed,
    "NotReady": NotReady,
}


@dataclass(slots=True)
class Opened:
    """One session's view of one project, with the access token of its page."""

    project: str
    session: str
    workdir: Path
    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))
    until: float = field(default_factory=lambda: time.monotonic() + TOKEN_S)
    port: int | None = None  # None while it is not running
    used: float = field(default_factory=time.monotonic)
    watching: int = 0
    shown: dict[str, Any] | None = None  # shown again after a restart of the process
    opening: threading.RLock = field(default_factory=threading.RLock, repr=False, compare=False)

    @property
    def name(self) -> str:
        """Name of the view in the viewer's process."""
        return f"{self.project}/{hashlib.sha256(self.session.encode()).hexdigest()[:16]}"


class _Process(Worker):
    """The viewer's process; many threads may wait for its answers, which come in any order."""

    def __init__(self, command: tuple[str, ...], log: Path) -> None:
        super().__init__(command, log)
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._waiting: dict[int, queue.SimpleQueue[Line | None]] = {}  # by command number; None once it has ended
        self._ended = False
        threading.Thread(target=self._hear, name="viewer-answers", daemon=True).start()

    def ask(self, command: Line, answer_s: float) -> Line | None:
        """The answer to a command; None where the process ended, or took longer."""
        number, answer = next(self._numbers), queue.SimpleQueue[Line | None]()
        with self._lock:  # lines must not mix
            self._waiting[number] = answer
            sent = not self._ended and self.say({"id": number, **command})
        try:
            return answer.get(timeout=answer_s) if sent else None
        except queue.Empty:
            return None
        finally:
            del self._waiting[number]

    def _hear(self) -> None:
        while (line := self._next()) is not None:
            if (waiting := self._waiting.get(line.get("id", 0))) is not None:
                waiting.put(line)
        with self._lock:
            self._ended = True
            for waiting in tuple(self._waiting.values()):
                waiting.put(None)

    def _next(self) -> Line | None:
        while True:
            with suppress(queue.Empty):
                return self.next_line(timeout=threading.TIMEOUT_MAX)


class Viewer:
    """All open 3D views. All methods are thread-safe; those that send commands wait for the process."""

    def __init__(self, settings: Settings, command: tuple[str, ...] = WORKER, *, enabled: bool = True) -> None:
        self.enabled = enabled
        self._settings, self._command = settings, command
        self.key = secrets.token_urlsafe(24)
        self._views: dict[tuple[str, str], Opened] = {}
        self._worker: _Process | None = None
        self._lock = threading.RLock()  # of the process and the table of views; nothing waits for an answer under it
        self._connections: Counter[str] = Counter()  # by person; used on the event loop
        self._stopped = False

    def open(self, project: str, workdir: Path, session: str) -> str:
        """Access token of this session's view; raises Unavailable when there is no viewer."""
        return self._running_view(project, workdir, session)[0].token

    def show(self, project: str, workdir: Path, session: str, wish: dict[str, Any]) -> dict[str, Any]:
        """Change what the session's view shows."""
        view, answer = self._ask_view(project, workdir, session, {"cmd": "show", **wish})
        view.shown = wish
        return answer

    def move(self, project: str, workdir: Path, session: str, values: dict[str, float]) -> dict[str, Any]:
        """Move joints of the shown scene."""
        return self._ask_view(project, workdir, session, {"cmd": "joints", "values": values})[1]

    def place(self, project: str, workdir: Path, session: str, pose: list[list[float]] | None) -> dict[str, Any]:
        """Set the pose of the object being moved, or only return it for None."""
        return self._ask_view(project, workdir, session, {"cmd": "place", "pose": pose})[1]

    def picked(self, project: str, workdir: Path, session: str) -> dict[str, Any]:
        """The last picked object or point in the session's view."""
        return self._ask_view(project, workdir, session, {"cmd": "picked"})[1]

    def camera(self, project: str, workdir: Path, session: str) -> dict[str, Any]:
        """Camera position and target of the session's view."""
        return self._ask_view(project, workdir, session, {"cmd": "camera"})[1]

    def port(self, token: str, session: str) -> int:
        """The loopback port behind a token, with its view restarted if it has stopped.

        Raises Forbidden for another session's token, Unavailable when there is no viewer.
        """
        view = self._opened(token, session)
        return self._running_view(view.project, view.workdir, session)[1]

    def running_port(self, token: str, session: str) -> int | None:
        """The same without waiting; None while the view is not running."""
        view = self._opened(token, session)
        view.used = time.monotonic()
        return self._port_of(view)

    def project_of(self, token: str) -> str | None:
        """The project of the view behind a token; None where there is none."""
        view = self._view_of(token)
        return view.project if view else None

    def close(self, project: str, of: Callable[[str], bool] = lambda session: True) -> None:
        """Close all views of a project, or those of some sessions, and invalidate their tokens."""
        for view in tuple(self._views.values()):
            if view.project == project and of(view.session):
                self._views.pop((view.project, view.session), None)
                self._end(view)

    def close_idle(self) -> None:
        """Close views unused for a while; their tokens open them again."""
        limit = time.monotonic() - self._settings.viewer_idle_s
        for key, view in tuple(self._views.items()):
            if view.used < limit and not view.watching:
                self._end(view)
            if view.until < time.monotonic() and view.port is None:
                self._views.pop(key, None)

    @contextmanager
    def watched(self, token: str, who: str) -> Iterator[None]:
        """Keep the view behind the token open during a connection; raises TooMany beyond the user's limit."""
        view = self._view_of(token)
        if view is None:
            raise Forbidden("this 3D view has been closed", hint="open the review page again")
        if self._connections[who] >= MOST_CONNECTIONS:
            raise TooMany(f"you already have {MOST_CONNECTIONS} 3D views connected", hint="close some tabs")
        self._connections[who] += 1
        view.watching += 1
        try:
            yield
        finally:
            view.watching -= 1
            view.used = time.monotonic()
            self._connections[who] -= 1
            self._connections += Counter()  # removes users without connections

    def stop(self) -> None:
        """End the process permanently; callers that wait for an answer are woken by this."""
        self._stopped = True
        worker = self._worker
        if worker is not None:
            worker.kill()
            worker.close()

    def _opened(self, token: str, session: str) -> Opened:
        """The session's view behind a token; raises Forbidden for anything else."""
        view = self._view_of(token)
        if view is None or view.session != session or view.until < time.monotonic():
            raise Forbidden("this 3D view belongs to another session or has expired", hint="open the review page again")
        return view

    def _view_of(self, token: str) -> Opened | None:
        return next(
            (view for view in tuple(self._views.values()) if secrets.compare_digest(view.token.encode(), token.encode())), None
        )

    def _ask_view(self, project: str, workdir: Path, session: str, command: dict[str, Any]) -> tuple[Opened, dict[str, Any]]:
        """Send a command to the session's view; a view closed in the meantime is reopened."""
        for _ in range(2):
            view, _ = self._running_view(project, workdir, session)
            try:
                return view, self._ask({**command, "view": view.name})
            except _Closed:
                view.port = None
        raise Unavailable("the 3D view was closed meanwhile", hint="try again in a moment")

    def _running_view(self, project: str, workdir: Path, session: str) -> tuple[Opened, int]:
        """The session's view, running and with its last content, and its port."""
        view = self._views.get((project, session))
        if view is not None and (port := self._port_of(view)):  # without the lock: a large scene may be in transfer
            view.used = time.monotonic()
            return view, port
        with self._lock:
            found = self._views.get((project, session))
            view = found if found is not None and found.until > time.monotonic() else Opened(project, session, workdir)
            view.used = time.monotonic()
            self._views[project, session] = view
        with view.opening:
            if port := self._port_of(view):
                return view, port
            self._make_room()
            port = view.port = int(self._ask({"cmd": "open", "view": view.name, "workdir": str(workdir)})["port"])
            self._show_again(view)
            return view, port

    def _port_of(self, view: Opened) -> int | None:
        """The view's port while it runs."""
        worker = self._worker
        return view.port if view.until > time.monotonic() and worker is not None and worker.alive else None

    def _show_again(self, view: Opened) -> None:
        """Restore the view's content after closing or a restart; deleted content is dropped."""
        wish, view.shown = view.shown, None
        if wish is None:
            return
        try:
            self._ask({"cmd": "show", "view": view.name, **wish})
            view.shown = wish
        except (InputError, NotReady):
            return

    def _make_room(self) -> None:
        running = [view for view in tuple(self._views.values()) if view.port is not None]
        if len(running) < MOST_VIEWS:
            return
        idle = sorted((view for view in running if not view.watching), key=lambda view: view.used)
        if not idle:
            raise Unavailable(
                f"{len(running)} people already have a 3D view open", hint="try again when one of them has closed it"
            )
        self._end(idle[0])

    def _end(self, view: Opened) -> None:
        port, view.port = view.port, None
        if port is not None and self._worker is not None and self._worker.alive:
            try:
                self._ask({"cmd": "close", "view": view.name})
            except (Unavailable, InputError):
                return

    def _ask(self, command: dict[str, Any]) -> dict[str, Any]:
        worker = self._running()
        answer = worker.ask(command, self._settings.viewer_answer_s)
        if answer is None:
            self._forget(worker)
            raise Unavailable("the 3D view has stopped", hint="try again: it restarts; its log is logs/viewer.log")
        if "error" in answer:
            error = answer["error"]
            raise _FAILURES.get(error["kind"], InputError)(error["message"], hint=error["hint"])
        result: dict[str, Any] = answer["ok"]
        return result

    def _forget(self, worker: _Process) -> None:
        with self._lock:
            if self._worker is not worker:  # another thread has done it
                return
            self._worker = None
            for view in tuple(self._views.values()):
                view.port = None
        worker.kill()
        worker.close()

    def _running(self) -> _Process:
        if not self.enabled:
            raise Unavailable("the 3D view is switched off", hint="use the picture and the mesh instead")
        if self._stopped:
            raise Unavailable("the server stops", hint="try again in a moment")
        with self._lock:
            if self._worker is not None and not self._worker.alive:
                self._forget(self._worker)
            if self._worker is None:
                worker = _Process(self._command, self._settings.data_dir / "logs" / "viewer.log")
                worker.say({"key": self.key})
                self._worker = worker
            if self._stopped:  # checked after assignment: either stop() sees the worker, or this check sees the stop
                self._worker.kill()
            return self._worker
