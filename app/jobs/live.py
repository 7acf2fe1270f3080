"""One live segmenter process per project: started on demand, stopped when idle, started anew when it vanished."""

import logging
import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from sqlalchemy import Engine

from app import schemas
from app.db.computing import worked
from app.db.engine import writing
from app.errors import body
from app.files import ProjectFiles
from app.hub import Hub
from app.jobs.far import ELEVATIONS, FarWorker
from app.jobs.live_session import LiveSession
from app.jobs.mask_store import MaskFile
from app.jobs.plans import Commands
from app.process import Worker
from app.settings import Settings
from app.store.protocol import Store
from r2c2r_core.errors import R2C2RError

_log = logging.getLogger(__name__)

IDLE_LOOK_S = 5.0
MOST_DEATHS = 2  # how often a process that vanished is started anew by itself
LEFT_S = 10.0
"""A preparation that no tab looks at any more is stopped after this: longer than a page takes to load anew."""
VANISHED = body("worker-died", "the live segmenter ended early", "click again to restart it; see its log")


class LiveSegmenters:
    """All live segmenters. `on_object` is told of every object whose masks came to an end.

    `on_again` is told of every object whose masks are to be drawn anew, with their key, for clicks on these others. `far`
    begins a process at a seat, where there is one for that.
    """

    def __init__(self, engine: Engine, hub: Hub, settings: Settings, commands: Commands, store: Store) -> None:
        self._engine, self._hub, self._settings, self._commands = engine, hub, settings, commands
        self._store = store
        self._sessions: dict[str, LiveSession] = {}
        self._ended: dict[str, LiveSession] = {}  # the last failure of each project
        self._lock = threading.RLock()
        self.telling = threading.Lock()  # held while objects are read and told: what is told last was read last
        self.far: Callable[[str, ProjectFiles, tuple[str, ...]], FarWorker | None] = lambda project, files, options: None
        self.on_object: Callable[[str, int], None] = lambda project, number: None
        self.on_again: Callable[[str, int, str, list[int]], None] = lambda project, number, key, others: None

    def open(self, project: str, files: ProjectFiles, segmenter: str) -> None:
        """Start the project's process unless it runs."""
        with self._lock:
            found = self._sessions.get(project)
            if found is not None and found.worker.alive:
                found.used = time.monotonic()
                return
            if found is not None and found.deaths < MOST_DEATHS:  # it has just vanished, and nobody has seen that yet
                self._revive(found)
                return
            session = self._started(project, files, segmenter)
        session.tell_status()

    def status(self, project: str) -> schemas.LiveStatus:
        """How far the project's process is."""
        with self._lock:
            session = self._sessions.get(project) or self._ended.get(project)
            return session.status if session else schemas.LiveStatus(state="off", fraction=0.0, text="", error=None)

    @property
    def running(self) -> int:
        """Projects that have a segmenter now."""
        with self._lock:
            return len(self._sessions)

    @property
    def projects(self) -> frozenset[str]:
        """Those projects."""
        with self._lock:
            return frozenset(self._sessions)

    @property
    def preparing(self) -> bool:
        """Whether a project is being prepared now."""
        with self._lock:
            return any(session.state in ("starting", "preparing") for session in self._sessions.values())

    def runs(self, project: str) -> bool:
        """Whether there is a process for the project."""
        with self._lock:
            return project in self._sessions

    def know(self, project: str, objects: list[dict[str, Any]]) -> None:
        """Tell the project's process, if there is one, of all its objects as app.jobs.disputes reads them."""
        with self._lock:
            session = self._sessions.get(project)
            if session is not None:
                session.know(objects)

    def segment(
        self,
        project: str,
        files: ProjectFiles,
        segmenter: str,
        number: int,
        key: str,
        prompt: dict[str, Any],
        objects: list[dict[str, Any]] | None,
    ) -> None:
        """Compute the object's masks for these clicks, before anything asked for earlier; a newer call supersedes.

        With it the process is told of all the project's objects; None where a call that follows at once tells it.
        """
        self.open(project, files, segmenter)
        with self._lock:
            session = self._sessions.get(project) or self._started(project, files, segmenter)  # it may be gone again
            session.segment(number, key, prompt, objects)

    def proposing(self, project: str) -> tuple[float, list[dict[str, Any]]] | None:
        """The share of the work of proposing that is done, and what came of it; None when nobody is at it."""
        with self._lock:
            session = self._sessions.get(project)
            if session is None or session.proposals_path is None:
                return None
            return session.proposed, list(session.proposals)

    def cancel(self, project: str, number: int) -> None:
        """Stop computing the object's masks; those there stay."""
        with self._lock:
            session = self._sessions.get(project)
            if session is not None:
                session.cancel(number)

    def task(self, project: str, number: int, key: str) -> tuple[schemas.SegmentState, MaskFile] | None:
        """The object's masks so far for these clicks, when they are being or were computed by the running process."""
        with self._lock:
            session = self._sessions.get(project)
            task = session.tasks.get(number) if session else None
            return (task.state, task.masks) if task is not None and task.key == key else None

    @contextmanager
    def held(self) -> Iterator[None]:
        """No masks come and none end meanwhile: what is told of them here is not overtaken by what is newer."""
        with self._lock:
            yield

    def close(self, project: str) -> None:
        """Stop the project's process."""
        with self._lock:
            session = self._sessions.pop(project, None)
            self._ended.pop(project, None)
            if session is not None:
                session.tasks.clear()  # nothing more is written for it
        if session is not None:
            session.worker.kill()
            session.worker.close()

    def stop(self) -> None:
        """Stop all processes; masks that were still to come are computed when the server is there again."""
        with self._lock:
            sessions, self._sessions = list(self._sessions.values()), {}
            for session in sessions:
                session.tasks.clear()
        for session in sessions:
            session.worker.kill()
            session.worker.close()

    def _started(self, project: str, files: ProjectFiles, segmenter: str) -> LiveSession:
        options = ("--width", str(self._settings.preview_width), "--segmenter", segmenter)
        command = (*self._commands.live, str(files.work), *options, ELEVATIONS, str(files.elevations))
        worker = self.far(project, files, options) or Worker(command, files.root / "logs" / "live.log")
        told = self._tell_object, self._tell_again
        session = LiveSession(project, files, segmenter, worker, self._hub, self._lock, *told)
        session.proposals_path = None if files.proposals.is_file() else files.proposals
        self._sessions[project] = session
        self._ended.pop(project, None)
        threading.Thread(target=self._follow, args=(session,), name=f"live-{project}", daemon=True).start()
        return session

    def _follow(self, session: LiveSession) -> None:
        """Read a process to its end."""
        while True:
            try:
                line = session.worker.next_line(timeout=IDLE_LOOK_S)
            except queue.Empty:
                if self._idle(session):
                    session.worker.kill()
                self._stop_if_left(session)
                self._store_work(session)
                continue
            if line is None:
                break
            self._stop_if_left(session)
            try:
                session.take(line)
            except OSError as error:  # a full disk must not end the process: the masks are shown, only not kept
                _log.warning("live masks of %s: %s", session.project, error)
            self._store_work(session)
            if "end" in line:
                self._keep(session.project)
        session.worker.close()
        self._gone(session)
        self._store_work(session)

    def _idle(self, session: LiveSession) -> bool:
        with self._lock:
            unused_s = time.monotonic() - session.used
            return session.state == "ready" and not session.working and unused_s > self._settings.live_idle_s

    def _stop_if_left(self, session: LiveSession) -> None:
        """End a preparation whose tabs have all gone elsewhere; what it finished is found again by the next."""
        now = time.monotonic()
        if self._hub.watched(session.project):
            session.watched = now
            return
        with self._lock:
            wanted = session.watched is None or now - session.watched < LEFT_S or session.tasks
            replaced = self._sessions.get(session.project) is not session
            if wanted or replaced or session.state not in ("starting", "preparing"):
                return
            del self._sessions[session.project]
        session.worker.kill()

    def _gone(self, session: LiveSession) -> None:
        with self._lock:
            stopped_by_us = self._sessions.get(session.project) is not session or self._idle(session)
            if self._sessions.get(session.project) is session:
                del self._sessions[session.project]
            failed = session.state == "failed" or not stopped_by_us
            if failed and session.error is None and session.state != "failed" and session.deaths < MOST_DEATHS:
                self._revive(session)
                return
            session.end((session.error or VANISHED) if failed else None)
            if failed:
                self._ended[session.project] = session
            if session.project not in self._sessions:  # nor has another one begun
                session.tell_status()

    def _revive(self, lost: LiveSession) -> None:
        """Go on in a new process with what the lost one had not finished."""
        _log.warning("the live segmenter of %s vanished: started anew", lost.project)
        session = self._started(lost.project, lost.files, lost.segmenter)
        session.deaths, session.watched, session.at_work = lost.deaths + 1, lost.watched, lost.at_work or session.at_work
        session.objects = lost.objects
        for number, task in lost.tasks.items():
            if task.is_open:
                session.segment(number, task.key, task.prompt, None)
        lost.tasks.clear()
        session.tell_status()

    def _tell_object(self, project: str, number: int) -> None:
        self.on_object(project, number)

    def _tell_again(self, project: str, number: int, key: str, others: list[int]) -> None:
        self.on_again(project, number, key, others)

    def _keep(self, project: str) -> None:
        """Have masks that ended where other servers see them; what fails is kept with the next, or when the cache is tidied."""
        try:
            self._store.keep(project)
        except (R2C2RError, OSError) as error:
            _log.warning("live masks of %s: %s", project, error)

    def _store_work(self, session: LiveSession) -> None:
        """Store when it was at work; not under the lock, for whoever writes to the database may wait for that."""
        with self._lock:
            times, session.worked = session.worked, []
        try:
            for began, ended in times:
                with writing(self._engine) as rows:
                    worked(rows, session.project, began, ended)
        except R2C2RError as error:  # a figure less
            _log.warning("the live segmenter's time for %s: %s", session.project, error)
