"""Job queue: durable rows, one process per stage, at most `heavy_jobs` at a time, plus one import.

A job belongs to the server that runs it. When a server dies, the next one kills its leftover processes and queues its jobs
again; finished stages are reused from the workspace, so little is computed twice. Servers that share a database send
heartbeats every few seconds, and take over the jobs of those that do not.
"""

import errno
import logging
import secrets
import threading
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import psutil
from opentelemetry.trace import StatusCode, TracerProvider

from app.errors import NoSpace, NotFound, Unavailable, told
from app.jobs.compute import seat_of
from app.jobs.plans import Commands, Step
from app.jobs.rows import JobRows
from app.jobs.seats import OwnSeat
from app.jobs.sharing import SharedStage, Sharing
from app.jobs.steps import HEARTBEAT_S, STORE_EVERY_S, VANISHED, JobProgress, listen, outcome
from app.logs import JOB
from app.metrics import Histogram
from app.privacy import without_places
from app.process import Line, Worker
from app.settings import Settings
from r2c2r_core.errors import EnvironmentProblem, R2C2RError

_log = logging.getLogger(__name__)

PREPARED, SHARED = 0.1, 0.9  # progress of a shared stage at which the sharing begins and ends
AWAY_S = 5.0  # before retrying a job whose database or store did not answer
UNEXPECTED = {"kind": "internal", "message": "the queue met an unexpected error", "hint": "see the server's log, then retry"}


class ServerStops(Exception):
    """The server stops; the job continues with the next server."""


class Runner:
    """Claims jobs from the table and runs them in threads that only wait for processes.

    `on_done` is called for every finished job with its project and kind; it must not raise.
    """

    def __init__(
        self, rows: JobRows, settings: Settings, commands: Commands, stages: Histogram, traces: TracerProvider
    ) -> None:
        self.rows, self.settings, self.commands, self._stages = rows, settings, commands, stages
        self._tracer = traces.get_tracer("r2c2r")
        self._files, self._seat = rows.store, OwnSeat(rows.engine, rows.owner, settings)
        self._compute = seat_of(settings, rows.store)
        self._wake, self._stopping = threading.Event(), threading.Event()
        self._sharing = Sharing(rows, settings, commands, self._compute, self._stopping)
        self.on_done: Callable[[str, str], None] = lambda project, kind: None
        self.draining, self.began = False, time.time()  # draining: no further jobs are claimed
        self._at: dict[int, tuple[str, Path | None]] = {}  # project and log of each job that runs here
        self._threads: list[threading.Thread] = []
        self._workers: dict[int, Worker] = {}
        self._cancelled: set[int] = set()
        self._deaths: Counter[int] = Counter()  # of a job's processes, since its last progress
        self._lock = threading.Lock()

    def start(self) -> None:
        """Recover an earlier server's jobs, and start; raises EnvironmentProblem beside seats of another version."""
        if self.rows.shared:
            self._seat.join()
        self.rows.recover()
        lanes = [(f"jobs-{number}", False) for number in range(self.settings.heavy_jobs)]
        if lanes:
            lanes.append(("jobs-import", True))
        for name, imports_only in lanes:
            thread = threading.Thread(target=self._loop, args=(imports_only,), name=name, daemon=True)
            thread.start()
            self._threads.append(thread)
        if self.rows.shared:
            for do in (self._beat, self._publish_logs):  # apart: a slow store must not delay a sign of life
                self._threads.append(threading.Thread(target=self._repeat, args=(do,), name=f"jobs{do.__name__}", daemon=True))
                self._threads[-1].start()

    def stop(self) -> None:
        """Stop the running workers; their jobs stay in the queue for the next start."""
        self._stopping.set()
        self._wake.set()
        for thread in self._threads:
            thread.join()
        if self._threads and self.rows.shared:
            self._seat.leave()

    @property
    def busy(self) -> int:
        """Number of jobs running here."""
        with self._lock:
            return len(self._workers)

    @property
    def projects(self) -> frozenset[str]:
        """Projects of jobs, and of parts of other seats' jobs, running here."""
        return self._sharing.projects.union(project_id for project_id, _ in tuple(self._at.values()))

    def queued(self, job_id: int) -> None:
        """Publish a newly queued job, and check whether it can start."""
        self._wake.set()
        self.rows.tell(job_id)

    def cancel(self, job_id: int) -> None:
        """Request cancellation of a job; immediate if it is waiting."""
        with self._lock:
            if self.rows.cancel(job_id):
                self._cancelled.add(job_id)
                if job_id in self._workers:
                    self._workers[job_id].ask_to_stop()

    def wait_until_idle(self, project_id: str, timeout_s: float) -> bool:
        """Wait until no process is running for the project; returns whether that was reached."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            if not self.rows.busy(project_id):
                return True
            time.sleep(0.02)
        return False

    def _loop(self, imports_only: bool) -> None:
        unfinished: int | None = None  # a job whose end could not be stored, e.g. on a full disk
        away: Unavailable | None = None  # why its end is pending: a resource is unavailable
        while not self._stopping.is_set():
            job_id = unfinished
            try:
                if unfinished is not None:
                    if away is None or self._was_cancelled(unfinished):
                        self._end(unfinished, UNEXPECTED)
                    else:
                        self.rows.give_back(unfinished, without_places(f"waits: {away.message}", self.settings))
                    unfinished = away = None
                    continue
                takes = not self.draining and self._has_memory()
                job_id = self.rows.claim(imports_only=imports_only) if takes else None
                if job_id is None:
                    if imports_only or not (takes and self._sharing.help()):
                        self._wake.wait(1.0)
                        self._wake.clear()
                    continue
                with self._tracer.start_as_current_span("job", attributes={"job": job_id, "seat": self.rows.owner}):
                    self._run(job_id)
                JOB.set(None)
            except NotFound as error:  # deleted with its project, or taken over by another server
                _log.warning("job %s: %s", job_id, error)
                self._forget(job_id or 0)
                unfinished = None
            except Unavailable as error:  # database or store
                _log.warning("job %s: %s", job_id, error)
                unfinished, away = job_id, error
                self._stopping.wait(AWAY_S)
            except Exception:  # the edge of a job: the queue continues after any error
                _log.exception("job %s", job_id)
                unfinished, away = job_id, None
                self._stopping.wait(1.0)

    def _repeat(self, do: Callable[[], None]) -> None:
        """Do this every `beat_s` until the runner stops."""
        while not self._stopping.wait(self.settings.beat_s):
            try:
                do()
            except R2C2RError as error:  # the database or the store is unavailable: try again
                _log.warning("%s: %s", do.__name__.strip("_"), error)
            except Exception:  # the edge of a thread: without heartbeats, other servers take over this one's jobs
                _log.exception(do.__name__.strip("_"))

    def _beat(self) -> None:
        """Send a heartbeat, and check those of other servers."""
        with self._lock:
            running = dict(self._workers)
        mine, self.draining = self.rows.beat(), self._seat.beat()
        for job_id, worker in running.items():
            if mine.get(job_id, True):  # cancelled at another server, or lost to one
                self._stop(job_id, worker)
        self.rows.recover()

    def _publish_logs(self) -> None:
        """Upload the logs of the running jobs in their current state."""
        for project_id, log in tuple(self._at.values()):
            if log is not None:
                self._files.keep_log(project_id, log)

    def _stop(self, job_id: int, worker: Worker) -> None:
        """Stop the job if it is still run by this worker, and was not queued again."""
        with self._lock:
            if self._workers.get(job_id) is worker:
                self._cancelled.add(job_id)
                worker.ask_to_stop()

    def _has_memory(self) -> bool:
        """Whether enough memory is free to start a job; if not, the next job reports why it waits."""
        free, needed = psutil.virtual_memory().available, self._compute.memory_bytes
        if free < needed:
            self.rows.next_waits(f"waits for memory: {free / 1e9:.1f} GB free, {needed / 1e9:.1f} GB needed")
        return free >= needed

    def _run(self, job_id: int) -> None:
        JOB.set(job_id)
        try:
            project_id = self.rows.project_of(job_id)
            self._at[job_id] = project_id, None
            holder = f"{self.rows.owner} {job_id} {secrets.token_hex(4)}"
            self._sharing.end(project_id)
            self._compute.ready(project_id, holder)
            steps, log = self.rows.begin(job_id, self.commands)
            self._at[job_id] = project_id, log
            progress = JobProgress(steps)
            for number, step in enumerate(steps):
                progress.at(number)
                about = {"job": job_id, "project": project_id}
                with self._tracer.start_as_current_span(f"stage {step.stage}", attributes=about) as span:
                    failure = self._run_stage(job_id, project_id, step, progress, log, holder)
                    if failure is not None:
                        span.set_status(StatusCode.ERROR, failure["message"])
                self._compute.ended(project_id)
                self._files.keep_log(project_id, log)
                self._files.keep(project_id)
                if failure is not None:
                    self._failed(job_id, failure)
                    return
                if self.rows.got_further(job_id, number + 1):
                    del self._deaths[job_id]
            kind = self.rows.finish(job_id)
            self._forget(job_id)
            self.on_done(project_id, kind)
        except ServerStops:
            self.rows.give_back(job_id, "waits for the server")
        except Unavailable:
            raise
        except (R2C2RError, OSError) as error:
            self._end(job_id, told(_said(error)))
        finally:
            self._at.pop(job_id, None)

    def _run_stage(
        self, job_id: int, project_id: str, step: Step, progress: JobProgress, log: Path, holder: str
    ) -> dict[str, Any] | None:
        """Run a step, with other seats if that is faster; None on success, else the failure."""
        began, failure, complete = time.monotonic(), None, False
        if self._sharing.is_worthwhile(step, step.objects):
            failure, complete = self._share(job_id, project_id, step, progress, log, holder)
        if failure is None and not complete:
            failure = self._run_step(job_id, project_id, step, progress, log)[0]
        self._ended(job_id, step.stage, failure, time.monotonic() - began)
        return failure

    def _share(
        self, job_id: int, project_id: str, step: Step, progress: JobProgress, log: Path, holder: str
    ) -> tuple[dict[str, Any] | None, bool]:
        """Compute the step's objects at all free seats: a failure that ends it, or None, and whether all are done."""
        progress.span = (0.0, PREPARED)
        failure, last = self._run_step(job_id, project_id, step.of(()), progress, log)
        left = last.get("left", ())
        if failure is not None or not self._sharing.is_worthwhile(step, len(left)):
            progress.span = (PREPARED, 1.0)
            return failure, not left
        progress.span = (PREPARED, SHARED)
        stage = SharedStage(
            job_id=job_id,
            project_id=project_id,
            step=step,
            holder=holder,
            log=log,
            progress=progress,
            store=partial(self._store, job_id, step, progress),
            stop=lambda: self._stopping.is_set() or self._was_cancelled(job_id),
        )
        complete = self._sharing.share(stage, left)
        progress.span = (SHARED, 1.0)
        if self._was_cancelled(job_id) or self.rows.is_cancelling(job_id):
            self._cancelled.add(job_id)
            return {"kind": "Cancelled", "message": f"{step.stage}: cancelled", "hint": ""}, False
        if self._stopping.is_set():
            raise ServerStops
        return None, complete

    def _run_step(
        self, job_id: int, project_id: str, step: Step, progress: JobProgress, log: Path
    ) -> tuple[dict[str, Any] | None, Line]:
        """Run one process; None on success, else the failure, and its last message."""
        worker = self._compute.start(job_id, project_id, step, log)
        with self._lock:
            self._workers[job_id] = worker
        try:
            self.rows.began_step(job_id, step.stage, progress.fraction, log, worker, progress.overall, progress.estimate_s())
            last = listen(
                worker,
                step.stage,
                stop=lambda: self._stopping.is_set() or self._was_cancelled(job_id),
                heard=partial(self._heard, job_id, step, progress),
                silent=partial(self._silent, job_id, step, progress),
                grace_s=self.settings.kill_grace_s,
            )
        finally:
            with self._lock:
                self._workers.pop(job_id, None)
            status = worker.close(self.settings.kill_grace_s)
        if self._stopping.is_set() and not self._was_cancelled(job_id) and "done" not in last:
            raise ServerStops
        return outcome(last, status, step.stage), last

    def _ended(self, job_id: int, stage: str, failure: dict[str, Any] | None, took_s: float) -> None:
        ended = "done" if failure is None else "cancelled" if self._was_cancelled(job_id) else "failed"
        self._stages.observe(took_s, stage, ended)
        _log.info("stage %s: %s", stage, ended, extra={"stage": stage, "seconds": round(took_s, 2)})

    def _heard(self, job_id: int, step: Step, progress: JobProgress, fraction: float, words: str) -> None:
        progress.reached(fraction)
        if progress.is_due(STORE_EVERY_S):
            self._store(job_id, step, progress, words)

    def _silent(self, job_id: int, step: Step, progress: JobProgress) -> None:
        if progress.is_due(HEARTBEAT_S):
            self._store(job_id, step, progress, None)

    def _store(self, job_id: int, step: Step, progress: JobProgress, words: str | None) -> None:
        try:
            self.rows.progressed(job_id, step.stage, progress.fraction, words, progress.overall, progress.estimate_s())
        except NotFound:  # the job was deleted
            self._cancelled.add(job_id)
        except R2C2RError as error:  # the work continues even if its progress cannot be stored
            _log.warning("job %s: %s", job_id, error)

    def _failed(self, job_id: int, failure: dict[str, Any]) -> None:
        """Retry the job if its process vanished, unless that happened too often at the same stage."""
        if failure["kind"] == VANISHED and not self._was_cancelled(job_id):
            self._deaths[job_id] += 1  # a vanished server does not count
            if self._deaths[job_id] < self.settings.job_attempts:
                self.rows.queue_again(job_id, failure["message"])
                self._wake.set()
                return
        self._end(job_id, failure)

    def _end(self, job_id: int, failure: dict[str, Any]) -> None:
        self.rows.end(job_id, "cancelled" if self._was_cancelled(job_id) else "failed", failure)
        self._forget(job_id)

    def _forget(self, job_id: int) -> None:
        self._cancelled.discard(job_id)
        del self._deaths[job_id]

    def _was_cancelled(self, job_id: int) -> bool:
        return job_id in self._cancelled


def _said(error: R2C2RError | OSError) -> R2C2RError:
    """The error as one line with the next step."""
    if isinstance(error, R2C2RError):
        return error
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return NoSpace("the disk is full", hint="free some space and retry: finished stages are kept")
    return EnvironmentProblem(f"{error.filename or 'a file'}: {error.strerror or error}", hint="see the server's log")
