"""State of one project's live segmenter: progress, masks and proposals, published to all tabs.

The segmenter gets all objects of the project, as a click on one may split the front of another, which is then segmented again.
The methods are called under the lock of app.jobs.live, except `take`, which acquires it.
"""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app import schemas
from app.errors import told_body
from app.files import ProjectFiles
from app.hub import Hub
from app.jobs import mask_store
from app.jobs.far import FarWorker
from app.jobs.mask_store import MaskFile, mask_path
from app.jobs.proposal_wire import write_proposals
from app.process import Line, Worker

_log = logging.getLogger(__name__)

NOTED_S = 10.0  # interval of recording work in progress, as the server may die


@dataclass(slots=True)
class Task:
    """One object being segmented."""

    key: str
    path: Path
    prompt: dict[str, Any]
    state: schemas.SegmentState = "waiting"
    asked: float = field(default_factory=time.monotonic)
    masks: MaskFile = field(default_factory=MaskFile)
    kept: bool = True  # whether all masks are in the file

    @property
    def is_open(self) -> bool:
        """Whether masks are still pending."""
        return self.state in ("waiting", "running")


@dataclass(slots=True)
class LiveSession:
    """One project's process. `on_object` is called for every completed object, `on_again` for each to be segmented again."""

    project: str
    files: ProjectFiles
    segmenter: str
    worker: Worker | FarWorker
    hub: Hub
    lock: threading.RLock
    on_object: Callable[[str, int], None]
    on_again: Callable[[str, int, str, list[int]], None]
    deaths: int = 0  # of processes before this one, since one finished an object
    state: schemas.LiveState = "starting"
    fraction: float = 0.0
    text: str = "starting"
    error: dict[str, Any] | None = None
    total: int = 0
    used: float = field(default_factory=time.monotonic)
    watched: float | None = None  # when a tab last watched it; None: never
    tasks: dict[int, Task] = field(default_factory=dict)
    objects: list[dict[str, Any]] = field(default_factory=list)  # the project's, in the format of app.jobs.disputes
    proposals_path: Path | None = None  # destination of proposals; None when all exist already
    proposals: list[dict[str, Any]] = field(default_factory=list)  # found so far, also by an interrupted search before this one
    proposed: float = 0.0  # fraction of the proposal work done
    at_work: float | None = field(default_factory=time.time)  # start of the work not yet recorded
    worked: list[tuple[float, float]] = field(default_factory=list)  # (began, ended), to be stored by the caller

    @property
    def status(self) -> schemas.LiveStatus:
        """Status of the process."""
        error = schemas.ErrorBody(**self.error) if self.error else None
        return schemas.LiveStatus(state=self.state, fraction=self.fraction, text=self.text, error=error)

    @property
    def working(self) -> bool:
        """Whether it has work that a user may be waiting for."""
        preparing = self.state in ("starting", "preparing")
        proposing = self.state == "ready" and self.proposals_path is not None
        return preparing or proposing or any(task.is_open for task in self.tasks.values())

    def know(self, objects: list[dict[str, Any]]) -> None:
        """Update the project's objects."""
        self.objects = objects
        if self.state == "ready":
            self.worker.say({"cmd": "objects", "objects": objects})

    def segment(self, number: int, key: str, prompt: dict[str, Any], objects: list[dict[str, Any]] | None) -> None:
        """Compute the object's masks with priority; an earlier request for it is superseded.

        `objects` are the project's current ones; None if another request that follows at once includes them.
        """
        self.used = time.monotonic()
        self.objects = self.objects if objects is None else objects
        path = mask_path(self.files.masks, number, key)
        mask_store.begin(path)
        task = self.tasks[number] = Task(key, path, prompt)
        if self.state == "ready":
            self._send(number, task, objects)
        self._note_work()
        self._tell_segment(number, task, restart=True)

    def cancel(self, number: int) -> None:
        """Stop computing the object's masks; existing ones are kept."""
        task = self.tasks.get(number)
        if task is None or not task.is_open:
            return
        if self.state == "ready":
            self.worker.say({"cmd": "cancel", "object": number})
        self._end_task(number, task, "cancelled", None)

    def end(self, error: dict[str, Any] | None) -> None:
        """Handle the end of the process: stopped, or with an error."""
        self.state, self.error = ("off", None) if error is None else ("failed", error)
        for number, task in self.tasks.items():
            if task.is_open:
                self._end_task(number, task, "cancelled" if error is None else "failed", error)
        self._note_work(ended=True)

    def take(self, line: Line) -> None:
        """Handle one message of the process."""
        if "state" in line:
            self._take_state(line)
        elif "proposals" in line:
            self._take_proposals(line)
        elif "again" in line:
            self.on_again(self.project, int(line["object"]), line["key"], line["again"])
        else:
            self._take_mask(line)

    def tell_status(self) -> None:
        """Publish the status to all tabs."""
        self.hub.publish("live", self.project, status=self.status.model_dump())

    def _take_state(self, line: Line) -> None:
        with self.lock:
            self.state = line["state"]
            self.fraction, self.text = float(line.get("fraction", 1.0)), str(line.get("text", ""))
            self.total = int(line.get("total", self.total))
            self.error = told_body(line["error"]) if line.get("error") else None
            self.used = time.monotonic()
            if self.state == "ready":
                self.know(self.objects)
                for number, task in self.tasks.items():
                    if task.state == "waiting":
                        task.asked = time.monotonic()
                        self._send(number, task, None)
                if self.proposals_path is not None:
                    self.worker.say({"cmd": "propose"})
            self._note_work()
        self.tell_status()

    def _take_proposals(self, line: Line) -> None:
        """Show and store the proposals so far; those of an interrupted search are kept until this one is complete."""
        with self.lock:
            self.used = time.monotonic()
            found, self.proposed = line["proposals"], float(line["fraction"])
            done, known = self.proposed >= 1.0, {one["id"] for one in found}
            before = self.proposals
            self.proposals = found if done else [*found, *(one for one in before if one["id"] not in known)]
            changed = done or self.proposals != before
            if changed and "error" not in line:
                self._keep_proposals()
            if done:
                self.proposals_path = None
            self._note_work()
        self.hub.publish("proposals", self.project, fraction=self.proposed, changed=changed)

    def _keep_proposals(self) -> None:
        try:
            if self.proposals_path is not None:
                write_proposals(self.proposals_path, self.proposed, self.proposals)
        except OSError as error:  # a full disk: those not stored are computed again another time
            _log.warning("proposals of %s: %s", self.project, error)

    def _take_mask(self, line: Line) -> None:
        number = int(line["object"])
        with self.lock:
            task = self.tasks.get(number)
            if task is None or task.key != line["key"] or not task.is_open:
                return  # superseded
            self.used = time.monotonic()
            if "end" in line:
                error = told_body(line["error"]) if line.get("error") else None
                task.masks.front, task.masks.others = line.get("front"), line.get("others", [])
                task.masks.doubts, task.masks.motions = line.get("doubts", []), line.get("motions", [])
                self._end_task(number, task, line["end"], error)
                return
            first = task.state == "waiting"
            task.state = "running"
            entry = {key: line[key] for key in ("frame", "confidence", "area", "mask")}
            task.masks.frames[int(line["frame"])] = entry
            counts = {"done": len(task.masks.frames), "total": self.total}
            self._note_work()
        try:
            mask_store.append(task.path, entry)
        except OSError as error:  # a full disk: they are shown anyway
            task.kept = False
            _log.warning("live masks of %s: %s", self.project, error)
        if first:
            waited_ms = 1000 * (time.monotonic() - task.asked)
            _log.info("%s: object %d: first mask after %.0f ms", self.project, number, waited_ms)
            self._tell_segment(number, task)
        shown = {"frame": entry["frame"], "confidence": entry["confidence"], "mask": entry["mask"]}
        self.hub.publish("mask", self.project, object=number, **counts, **shown)

    def _send(self, number: int, task: Task, objects: list[dict[str, Any]] | None) -> None:
        command = {"cmd": "segment", "object": number, "key": task.key, "prompt": task.prompt}
        self.worker.say(command if objects is None else {**command, "objects": objects})

    def _end_task(self, number: int, task: Task, end: str, error: dict[str, Any] | None) -> None:
        task.masks.end, task.masks.error = end, error
        task.state = "done" if end == "done" else "failed" if end == "failed" else "partial"
        self.deaths = 0 if end == "done" else self.deaths
        try:
            mask_store.finish(task.path, end, error, task.masks)
        except OSError:
            task.kept = False
        self._note_work()
        self._tell_segment(number, task)
        if end == "done" and task.kept and self.tasks.get(number) is task:
            del self.tasks[number]  # they are read from the file from now on
        self.on_object(self.project, number)

    def _note_work(self, *, ended: bool = False) -> None:
        """Record working time: at its end, and periodically before."""
        now, working = time.time(), self.working and not ended
        if self.at_work is not None and (not working or now - self.at_work > NOTED_S):
            self.worked.append((self.at_work, now))
            self.at_work = None
        if working and self.at_work is None:
            self.at_work = now

    def _tell_segment(self, number: int, task: Task, *, restart: bool = False) -> None:
        counts = {"done": len(task.masks.frames), "total": self.total}
        said = {"state": task.state, "error": task.masks.error, "restart": restart}
        self.hub.publish("segment", self.project, object=number, **said, **counts)
