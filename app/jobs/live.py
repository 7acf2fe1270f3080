"""One live segmenter process per project: started on demand, stopped when idle, fed with clicks, its masks kept and shown."""

import contextlib
import json
import logging
import queue
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app import schemas
from app.errors import KINDS
from app.files import ProjectFiles
from app.hub import Hub
from app.jobs import mask_store
from app.jobs.mask_store import MaskFile, mask_path
from app.jobs.plans import Commands
from app.process import Worker
from app.settings import Settings
from r2c2r_core.workspace import write_atomically

_log = logging.getLogger(__name__)

IDLE_LOOK_S = 5.0
MOST_DEATHS = 2  # how often a process that vanished is started anew by itself
LEFT_S = 10.0
"""A preparation that no tab looks at any more is stopped after this: longer than a page takes to load anew."""


@dataclass(slots=True)
class _Task:
    """One object being segmented."""

    key: str
    path: Path
    prompt: dict[str, Any]
    state: schemas.SegmentState = "waiting"
    asked: float = field(default_factory=time.monotonic)
    masks: MaskFile = field(default_factory=MaskFile)


@dataclass(slots=True)
class _Session:
    """One project's process."""

    project: str
    files: ProjectFiles
    segmenter: str
    worker: Worker
    deaths: int = 0  # of processes before this one, since one finished an object
    state: schemas.LiveState = "starting"
    fraction: float = 0.0
    text: str = "starting"
    error: dict[str, Any] | None = None
    total: int = 0
    used: float = field(default_factory=time.monotonic)
    watched: float | None = None  # when a tab last looked; None when none ever did
    tasks: dict[int, _Task] = field(default_factory=dict)
    proposals_path: Path | None = None  # where proposals go; None when they are there already
    proposals: list[dict[str, Any]] = field(default_factory=list)
    proposed: float = 0.0  # share of the work of proposing


class LiveSegmenters:
    """All live segmenters."""

    def __init__(self, hub: Hub, settings: Settings, commands: Commands) -> None:
        self._hub, self._settings, self._commands = hub, settings, commands
        self._sessions: dict[str, _Session] = {}
        self._ended: dict[str, _Session] = {}  # the last failure of each project
        self._lock = threading.RLock()
        self.on_object = lambda project, number: None  # services tell tabs about the object

    def open(self, project: str, files: ProjectFiles, segmenter: str) -> None:
        """Start the project's process unless it runs."""
        with self._lock:
            found = self._sessions.get(project)
            if found is not None and found.worker.alive:
                found.used = time.monotonic()
                return
            options = ("--width", str(self._settings.preview_width), "--segmenter", segmenter)
            command = (*self._commands.live, str(files.work), *options)
            session = _Session(project, files, segmenter, Worker(command, files.root / "logs" / "live.log"))
            session.proposals_path = None if files.proposals.is_file() else files.proposals
            self._sessions[project] = session
            self._ended.pop(project, None)
        threading.Thread(target=self._follow, args=(session,), name=f"live-{project}", daemon=True).start()
        self._tell_status(session)

    def status(self, project: str) -> schemas.LiveStatus:
        """How far the project's process is."""
        with self._lock:
            session = self._sessions.get(project) or self._ended.get(project)
            return _status(session)

    def segment(self, project: str, files: ProjectFiles, segmenter: str, number: int, key: str, prompt: dict[str, Any]) -> None:
        """Compute the object's masks for these clicks, before anything asked for earlier; a newer call supersedes."""
        self.open(project, files, segmenter)
        with self._lock:
            session = self._sessions[project]
            session.used = time.monotonic()
            path = mask_path(files.masks, number, key)
            mask_store.begin(path)
            session.tasks[number] = _Task(key, path, prompt)
            if session.state == "ready":
                self._send(session, number)
        self._tell_segment(session, number, restart=True)

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
            task = session.tasks.get(number) if session else None
            if session is None or task is None or task.state not in ("waiting", "running"):
                return
            if session.state == "ready":
                session.worker.say({"cmd": "cancel", "object": number})
            self._end_task(session, number, task, "cancelled", None)

    def task(self, project: str, number: int, key: str) -> tuple[schemas.SegmentState, MaskFile] | None:
        """The object's masks so far for these clicks, when they are being or were computed by the running process."""
        with self._lock:
            session = self._sessions.get(project)
            task = session.tasks.get(number) if session else None
            return (task.state, task.masks) if task is not None and task.key == key else None

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
        """Stop all processes."""
        with self._lock:
            sessions, self._sessions = list(self._sessions.values()), {}
        for session in sessions:
            session.worker.kill()
            session.worker.close()

    def _follow(self, session: _Session) -> None:
        """Read a process to its end."""
        while True:
            try:
                line = session.worker.next_line(timeout=IDLE_LOOK_S)
            except queue.Empty:
                if self._idle(session):
                    session.worker.kill()
                self._stop_if_left(session)
                continue
            if line is None:
                break
            self._stop_if_left(session)
            try:
                self._take(session, line)
            except OSError as error:  # a full disk must not end the process: the masks are shown, only not kept
                _log.warning("live masks of %s: %s", session.project, error)
        session.worker.close()
        self._gone(session)

    def _take(self, session: _Session, line: dict[str, Any]) -> None:
        if "state" in line:
            self._take_state(session, line)
            return
        if "proposals" in line:
            self._take_proposals(session, line)
            return
        number = int(line["object"])
        with self._lock:
            task = session.tasks.get(number)
            if task is None or task.key != line["key"] or task.state not in ("waiting", "running"):
                return  # superseded
            session.used = time.monotonic()
            if "end" in line:
                self._end_task(session, number, task, line["end"], line.get("error"))
                return
            first = task.state == "waiting"
            task.state = "running"
            entry = {key: line[key] for key in ("frame", "confidence", "area", "mask")}
            task.masks.frames[int(line["frame"])] = entry
            done, total = len(task.masks.frames), session.total
        mask_store.append(task.path, entry)
        if first:
            waited_ms = 1000 * (time.monotonic() - task.asked)
            _log.info("%s: object %d: first mask after %.0f ms", session.project, number, waited_ms)
            self._tell_segment(session, number)
        shown = {"frame": entry["frame"], "confidence": entry["confidence"], "mask": entry["mask"]}
        self._hub.publish("mask", session.project, object=number, done=done, total=total, **shown)

    def _take_state(self, session: _Session, line: dict[str, Any]) -> None:
        with self._lock:
            session.state = line["state"]
            session.fraction, session.text = float(line.get("fraction", 1.0)), str(line.get("text", ""))
            session.total, session.error = int(line.get("total", session.total)), line.get("error")
            session.used = time.monotonic()
            if session.state == "ready":
                for number in list(session.tasks):
                    if session.tasks[number].state == "waiting":
                        session.tasks[number].asked = time.monotonic()
                        self._send(session, number)
                if session.proposals_path is not None:
                    session.worker.say({"cmd": "propose"})
        self._tell_status(session)

    def _take_proposals(self, session: _Session, line: dict[str, Any]) -> None:
        with self._lock:
            session.used = time.monotonic()
            grown = len(line["proposals"]) != len(session.proposals)
            session.proposals, session.proposed = line["proposals"], float(line["fraction"])
            done = session.proposed >= 1.0
            if done and session.proposals_path is not None:
                if "error" not in line:
                    write_atomically(session.proposals_path, json.dumps(session.proposals).encode())
                session.proposals_path = None
        self._hub.publish("proposals", session.project, fraction=session.proposed, changed=grown or done)

    def _send(self, session: _Session, number: int) -> None:
        task = session.tasks[number]
        session.worker.say({"cmd": "segment", "object": number, "key": task.key, "prompt": task.prompt})

    def _end_task(self, session: _Session, number: int, task: _Task, end: str, error: dict[str, Any] | None) -> None:
        task.masks.end, task.masks.error = end, _named(error)
        task.state = "done" if end == "done" else "failed" if end == "failed" else "partial"
        session.deaths = 0 if end == "done" else session.deaths
        with contextlib.suppress(OSError):
            mask_store.append(task.path, {"end": end, "error": task.masks.error})
        self._tell_segment(session, number)
        self.on_object(session.project, number)

    def _idle(self, session: _Session) -> bool:
        with self._lock:
            working = any(task.state in ("waiting", "running") for task in session.tasks.values())
            working = working or session.proposals_path is not None
            return session.state == "ready" and not working and time.monotonic() - session.used > self._settings.live_idle_s

    def _stop_if_left(self, session: _Session) -> None:
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

    def _gone(self, session: _Session) -> None:
        with self._lock:
            stopped_by_us = self._sessions.get(session.project) is not session or (
                session.state == "ready" and self._idle(session)
            )
            if self._sessions.get(session.project) is session:
                del self._sessions[session.project]
            vanished = not stopped_by_us and session.state != "failed" and session.error is None
            if vanished and session.deaths < MOST_DEATHS:
                self._revive(session)
                return
            failed = session.state == "failed" or not stopped_by_us
            if failed:
                if session.error is None:
                    message = "the live segmenter ended early"
                    session.error = {
                        "kind": "worker-died",
                        "message": message,
                        "hint": "click again to restart it; see its log",
                    }
                session.state, session.error = "failed", _named(session.error)
                self._ended[session.project] = session
            else:
                session.state = "off"
            for number, task in session.tasks.items():
                if task.state in ("waiting", "running"):
                    self._end_task(session, number, task, "failed" if failed else "cancelled", session.error)
        self._tell_status(session)

    def _revive(self, lost: _Session) -> None:
        """Go on in a new process with what the lost one had not finished."""
        _log.warning("the live segmenter of %s vanished: started anew", lost.project)
        self.open(lost.project, lost.files, lost.segmenter)
        self._sessions[lost.project].deaths = lost.deaths + 1
        self._sessions[lost.project].watched = lost.watched
        for number, task in lost.tasks.items():
            if task.state in ("waiting", "running"):
                self.segment(lost.project, lost.files, lost.segmenter, number, task.key, task.prompt)

    def _tell_status(self, session: _Session) -> None:
        self._hub.publish("live", session.project, status=_status(session).model_dump())

    def _tell_segment(self, session: _Session, number: int, *, restart: bool = False) -> None:
        task = session.tasks[number]
        counts = {"done": len(task.masks.frames), "total": session.total}
        self._hub.publish(
            "segment", session.project, object=number, state=task.state, error=task.masks.error, restart=restart, **counts
        )


def _status(session: _Session | None) -> schemas.LiveStatus:
    if session is None:
        return schemas.LiveStatus(state="off", fraction=0.0, text="", error=None)
    error = schemas.ErrorBody(**session.error) if session.error else None
    return schemas.LiveStatus(state=session.state, fraction=session.fraction, text=session.text, error=error)


def _named(error: dict[str, Any] | None) -> dict[str, Any] | None:
    """A worker's error with the app's kind instead of the class name."""
    if error is None:
        return None
    by_class = {cls.__name__: kind for cls, kind, _ in KINDS}
    kind = str(error.get("kind", "error"))
    words = {"message": str(error.get("message", "")), "hint": str(error.get("hint", ""))}
    return {"kind": by_class.get(kind, kind if kind.islower() else "internal"), **words}
