"""Live segmenters: one process per project, started on demand, stopped when idle, restarted after a crash."""

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
from app.jobs.proposal_wire import read_proposals
from app.process import Worker
from app.settings import Settings
from app.store.protocol import Store
from r2c2r_core.errors import R2C2RError

_log = logging.getLogger(__name__)

IDLE_LOOK_S = 5.0
MOST_DEATHS = 2  # maximum automatic restarts of a crashed process
LEFT_S = 10.0
"""Seconds after which a preparation without watching tabs is stopped: longer than a page reload takes."""
VANISHED = body("worker-died", "the live segmenter stopped unexpectedly", "click again to restart it; see its log")


class LiveSegmenters:
    """All live segmenters. `on_object` is called for every object with completed masks.

    `on_again` is called for every object whose masks must be recomputed, with their key, because of clicks on the given other
    objects. `far` starts a process at a remote seat, if there is one.
    """

    def __init__(self, engine: Engine, hub: Hub, settings: Settings, commands: Commands, store: Store) -> None:
        self._engine, self._hub, self._settings, self._commands = engine, hub, settings, commands
        self._store = store
        self._sessions: dict[str, LiveSession] = {}
        self._ended: dict[str, LiveSession] = {}  # the last failure of each project
        self._lock = threading.RLock()
        self.telling = threading.Lock()  # held while objects are read and sent, to keep their order
        self.far: Callable[[str, ProjectFiles, tuple[str, ...]], FarWorker | None] = lambda project, files, options: None
        self.on_object: Callable[[str, int], None] = lambda project, number: None
        self.on_again: Callable[[str, int, str, list[int]], None] = lambda project, number, key, others: None

    def open(self, project: str, files: ProjectFiles, segmenter: str) -> None:
        """Start the project's process unless it is running."""
        with self._lock:
            found = self._sessions.get(project)
            if found is not None and found.worker.alive:
                found.used = time.monotonic()
                return
            if found is not None and found.deaths < MOST_DEATHS:  # it has just crashed, which was not detected yet
                self._revive(found)
                return
            session = self._started(project, files, segmenter)
        session.tell_status()

    def status(self, project: str) -> schemas.LiveStatus:
        """Status of the project's process."""
        with self._lock:
            session = self._sessions.get(project) or self._ended.get(project)
            return session.status if session else schemas.LiveStatus(state="off", fraction=0.0, text="", error=None)

    @property
    def running(self) -> int:
        """Number of running segmenters."""
        with self._lock:
            return len(self._sessions)

    @property
    def projects(self) -> frozenset[str]:
        """Projects with a running segmenter."""
        with self._lock:
            return frozenset(self._sessions)

    @property
    def preparing(self) -> bool:
        """Whether any project is being prepared."""
        with self._lock:
            return any(session.state in ("starting", "preparing") for session in self._sessions.values())

    def runs(self, project: str) -> bool:
        """Whether there is a process for the project."""
        with self._lock:
            return project in self._sessions

    def know(self, project: str, objects: list[dict[str, Any]]) -> None:
        """Send the project's process, if there is one, all its objects in the format of app.jobs.disputes."""
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
        """Compute the object's masks for these clicks with priority; a newer call supersedes it.

        `objects` are all objects of the project; None if a call that follows at once sends them.
        """
        self.open(project, files, segmenter)
        with self._lock:
            session = self._sessions.get(project) or self._started(project, files, segmenter)  # it may have ended again
            session.segment(number, key, prompt, objects)

    def proposing(self, project: str) -> tuple[float, list[dict[str, Any]]] | None:
        """Completed fraction of proposing, and the proposals so far; None when none is in progress."""
        with self._lock:
            session = self._sessions.get(project)
            if session is None or session.proposals_path is None:
                return None
            return session.proposed, list(session.proposals)

    def cancel(self, project: str, number: int) -> None:
        """Stop computing the object's masks; existing ones are kept."""
        with self._lock:
            session = self._sessions.get(project)
            if session is not None:
                session.cancel(number)

    def task(self, project: str, number: int, key: str) -> tuple[schemas.SegmentState, MaskFile] | None:
        """The object's masks so far for these clicks, if computed by the running process."""
        with self._lock:
            session = self._sessions.get(project)
            task = session.tasks.get(number) if session else None
            return (task.state, task.masks) if task is not None and task.key == key else None

    @contextmanager
    def held(self) -> Iterator[None]:
        """Context that blocks mask updates, so that messages sent in it are not overtaken by newer ones."""
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
        """Stop all processes; pending masks are computed after the next start of the server."""
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
        done, session.proposals = read_proposals(files.proposals)
        session.proposals_path = files.proposals if done < 1.0 else None
        self._sessions[project] = session
        self._ended.pop(project, None)
        threading.Thread(target=self._follow, args=(session,), name=f"live-{project}", daemon=True).start()
        return session

    def _follow(self, session: LiveSession) -> None:
        """Read a process's messages until it ends."""
        while True:
            try:
                if not self._take_next(session):
                    break
            except OSError as error:  # a full disk must not end the process: masks are shown but not stored
                _log.warning("live masks of %s: %s", session.project, error)
            except Exception:  # the edge of a thread: one message must not affect the others
                _log.exception("live masks of %s", session.project)
        session.worker.close()
        self._gone(session)
        self._store_work(session)

    def _take_next(self, session: LiveSession) -> bool:
        """Handle the process's next message, or a pause without one; False after the last message."""
        try:
            line = session.worker.next_line(timeout=IDLE_LOOK_S)
        except queue.Empty:
            if self._idle(session):
                session.worker.kill()
            self._stop_if_left(session)
            self._store_work(session)
            return True
        if line is None:
            return False
        self._stop_if_left(session)
        try:
            session.take(line)
        finally:
            self._store_work(session)
        if "end" in line:
            self._keep(session.project)
        return True

    def _idle(self, session: LiveSession) -> bool:
        with self._lock:
            unused_s = time.monotonic() - session.used
            return session.state == "ready" and not session.working and unused_s > self._settings.live_idle_s

    def _stop_if_left(self, session: LiveSession) -> None:
        """Stop a preparation without watching tabs; finished parts are reused by the next one."""
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
            if session.project not in self._sessions:  # and no other one has started
                session.tell_status()

    def _revive(self, lost: LiveSession) -> None:
        """Continue the unfinished work of a crashed process in a new one."""
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
        """Upload completed masks for other servers; failures are retried with the next ones, or on tidying."""
        try:
            self._store.keep(project)
        except (R2C2RError, OSError) as error:
            _log.warning("live masks of %s: %s", project, error)

    def _store_work(self, session: LiveSession) -> None:
        """Store working times, without the lock, as a database writer may wait for it."""
        with self._lock:
            times, session.worked = session.worked, []
        try:
            for began, ended in times:
                with writing(self._engine) as rows:
                    worked(rows, session.project, began, ended)
        except R2C2RError as error:  # only a statistic is lost
            _log.warning("the live segmenter's time for %s: %s", session.project, error)
