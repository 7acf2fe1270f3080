"""Distribution of a stage's objects to idle seats: the job's owner offers them, the others help.

A shared stage has three phases: its own process computes the shared inputs and reports the remaining objects; these are the
parts, computed at any free seat; if some of them failed, the stage is then run as usual, reuses the stored parts, computes
the rest, and reports failures. So a failing part costs only time, and the next stage that is not per object finds, or
computes, all its inputs.
"""

import contextlib
import logging
import math
import socket
import tempfile
import threading
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from app.jobs.compute import Seat
from app.jobs.parts import Claimed, PartRows
from app.jobs.plans import Commands, Step, placed_request
from app.jobs.rows import JobRows
from app.jobs.steps import HEARTBEAT_S, STORE_EVERY_S, JobProgress, listen
from app.logs import JOB
from app.settings import Settings
from r2c2r_core.errors import R2C2RError
from r2c2r_core.pool import usual_workers

_log = logging.getLogger(__name__)

FEWEST = 2  # minimum number of objects to share
LOOK_S = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedStage:
    """A shared stage of a job that runs here, with its callbacks."""

    job_id: int
    project_id: str
    step: Step
    holder: str  # as in the store
    log: Path
    progress: JobProgress
    store: Callable[[str | None], None]  # stores the progress, with a new message if there is one
    stop: Callable[[], bool]


class Sharing:
    """Sharing of objects between this process and others; `stopping` ends it."""

    def __init__(self, rows: JobRows, settings: Settings, commands: Commands, compute: Seat, stopping: threading.Event) -> None:
        self._rows, self._settings, self._commands, self._compute = rows, settings, commands, compute
        self._parts = PartRows(rows.engine, rows.owner, settings)
        self._stopping = stopping
        self._here: dict[int, str] = {}  # projects of the parts computed here, by the first part of each claim
        self._several = rows.shared or settings.heavy_jobs > 1

    @property
    def projects(self) -> frozenset[str]:
        """Projects of the parts computed here."""
        return frozenset(self._here.copy().values())

    def is_worthwhile(self, step: Step, objects: int) -> bool:
        """Whether there are idle seats, and sharing so many objects of the step saves time."""
        spare = self._parts.spare() if self._several and objects >= FEWEST else 0
        return spare > 0 and objects * step.object_s * spare / (spare + 1) > self._settings.sharing_costs_s

    def help(self) -> bool:
        """Compute some objects of another seat's job; False if none are waiting."""
        claimed = self._parts.claim(self._side_by_side) if self._several else None
        if claimed is None:
            return False
        JOB.set(claimed.job_id)
        try:
            self._compute_part(claimed, self._stopping.is_set, lambda: None)
        except (R2C2RError, OSError) as error:  # this seat's own failure: the job continues without it
            _log.warning("%s of job %s: %s", claimed.stage, claimed.job_id, error)
            self._stopping.wait(1.0)
        finally:
            JOB.set(None)
        return True

    def share(self, shared: SharedStage, names: Collection[str]) -> bool:
        """Compute the objects here and at free seats, and fetch their files; returns whether that completed the stage."""
        self._compute.ended(shared.project_id)  # the shared inputs
        self._rows.store.keep(shared.project_id)
        step = shared.step
        at_least = max(1, math.ceil(self._settings.sharing_costs_s / step.object_s))
        self._parts.begin(shared.job_id, step.stage, names, shared.holder, at_least)
        shared.store(f"0 of {len(names)} objects")
        try:
            while self._parts.is_open(shared.job_id) and not shared.stop():
                claimed = self._parts.claim(self._side_by_side, shared.job_id)
                if claimed is None:
                    self._stopping.wait(LOOK_S)
                else:
                    self._compute_part(claimed, shared.stop, lambda: self._tell(shared))
                self._tell(shared)
            counted = self._parts.counted(shared.job_id)
        finally:
            self._write_down(shared)
            self.end(shared.project_id)
        self._compute.ready(shared.project_id, shared.holder, taken=True)
        _, files = self._rows.step_of(shared.job_id, step.stage, self._commands)
        placed_request(files.request(shared.job_id), files)
        return counted["done"] == len(names)

    def end(self, project_id: str) -> None:
        """Wait until no parts of the project are being computed, for this job or one whose owner is gone."""
        while self._several and not self._parts.end(project_id) and not self._stopping.wait(LOOK_S):
            pass

    def _compute_part(self, claimed: Claimed, stop: Callable[[], bool], tell: Callable[[], None]) -> None:
        """Run one process, from fetching its inputs to storing its results."""
        with self._at_it(claimed) as unwanted, tempfile.TemporaryDirectory(prefix="r2c2r-part-") as scratch:
            self._compute.ready(claimed.project_id, claimed.holder, taken=True)
            step, files = self._rows.step_of(claimed.job_id, claimed.stage, self._commands)
            log = Path(scratch, "log")
            log.write_text(f"{claimed.stage} of {', '.join(claimed.names)} at {socket.gethostname()}:\n")
            worker = self._compute.start_part(claimed, step, files, log)
            try:
                last = listen(
                    worker,
                    claimed.stage,
                    stop=lambda: stop() or unwanted.is_set(),
                    heard=lambda _fraction, _words: tell(),
                    silent=tell,
                    grace_s=self._settings.kill_grace_s,
                )
            finally:
                worker.close(self._settings.kill_grace_s)
            self._compute.ended(claimed.project_id)
            self._rows.store.keep(claimed.project_id)
            said = log.read_text(errors="replace")
            if "done" in last or ("error" in last and not stop()):  # the stage reports failures
                self._parts.done(claimed, said, failed="error" in last or bool(last["failures"]))
            else:
                self._parts.give_back(claimed, said, tried=not stop())

    @contextlib.contextmanager
    def _at_it(self, claimed: Claimed) -> Iterator[threading.Event]:
        """Context that sends heartbeats for the parts; the event is set when they are no longer wanted from this process.

        On an error, the parts are released for others.
        """
        unwanted, ended = threading.Event(), threading.Event()

        def beat() -> None:
            while not ended.wait(HEARTBEAT_S):
                try:
                    if not self._parts.beat(claimed):
                        unwanted.set()
                except R2C2RError as error:  # the database is unavailable: try again
                    _log.warning("sign of life of a part: %s", error)
                except Exception:  # the edge of a thread: without heartbeats, another seat takes the parts
                    _log.exception("sign of life of a part")

        beating = threading.Thread(target=beat, name=f"jobs-part-{claimed.ids[0]}", daemon=True)
        self._here[claimed.ids[0]] = claimed.project_id
        beating.start()
        try:
            yield unwanted
        except BaseException:
            with contextlib.suppress(R2C2RError):
                self._parts.give_back(claimed, "", tried=True)
            raise
        finally:
            ended.set()
            beating.join()
            del self._here[claimed.ids[0]]

    def _tell(self, shared: SharedStage) -> None:
        """Update the job's progress and log from the parts."""
        if not shared.progress.is_due(STORE_EVERY_S):
            return
        self._write_down(shared)
        counted = self._parts.counted(shared.job_id)
        done, count, before = counted["done"] + counted["failed"], counted.total(), shared.progress.fraction
        shared.progress.reached(done / max(count, 1))  # none: it was deleted
        shared.store(f"{done} of {count} objects" if shared.progress.fraction > before else None)

    def _write_down(self, shared: SharedStage) -> None:
        with shared.log.open("a") as log:
            log.writelines(self._parts.take_logs(shared.job_id))

    @property
    def _side_by_side(self) -> int:
        return self._settings.workers_a_job or usual_workers()
