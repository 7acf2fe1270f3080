"""The queue: durable rows, one process per stage, at most `heavy_jobs` at a time.

A job belongs to the server that runs it. When a server dies, the next one ends what it left running and queues its jobs
again; finished stages are found in the workspace, so little is done twice.
"""

import errno
import logging
import threading
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import psutil

from app.errors import NoSpace, NotFound, told
from app.jobs.plans import Commands, Step
from app.jobs.rows import JobRows
from app.jobs.steps import HEARTBEAT_S, STORE_EVERY_S, VANISHED, JobProgress, listen, outcome
from app.process import Worker
from app.settings import Settings
from r2c2r_core.errors import EnvironmentProblem, R2C2RError

_log = logging.getLogger(__name__)

UNEXPECTED = {"kind": "internal", "message": "the queue met an unexpected error", "hint": "see the server's log, then retry"}


class ServerStops(Exception):
    """The job goes on with the next server."""


class Runner:
    """Takes jobs from the table and runs them in threads that only wait for processes."""

    def __init__(self, rows: JobRows, settings: Settings, commands: Commands) -> None:
        self.rows, self.settings, self.commands = rows, settings, commands
        self._wake, self._stopping = threading.Event(), threading.Event()
        self._threads: list[threading.Thread] = []
        self._workers: dict[int, Worker] = {}
        self._cancelled: set[int] = set()
        self._deaths: Counter[int] = Counter()  # of a job's processes, since it last got further
        self._lock = threading.Lock()

    def start(self) -> None:
        """Take up what an earlier server left, and begin."""
        self.rows.recover()
        for number in range(self.settings.heavy_jobs):
            thread = threading.Thread(target=self._loop, name=f"jobs-{number}", daemon=True)
            thread.start()
            self._threads.append(thread)

    def stop(self) -> None:
        """End the running workers; their jobs wait in the queue for the next start."""
        self._stopping.set()
        self._wake.set()
        for thread in self._threads:
            thread.join()

    def queued(self, job_id: int) -> None:
        """A job waits: show it, and look whether it can begin."""
        self._wake.set()
        self.rows.tell(job_id)

    def cancel(self, job_id: int) -> None:
        """Ask a job to stop; done at once when it only waits."""
        with self._lock:
            if self.rows.cancel(job_id):
                self._cancelled.add(job_id)
                if job_id in self._workers:
                    self._workers[job_id].ask_to_stop()

    def wait_until_idle(self, project_id: str, timeout_s: float) -> bool:
        """Whether no process works for the project any more."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            if not self.rows.busy(project_id):
                return True
            time.sleep(0.02)
        return False

    def _loop(self) -> None:
        unfinished: int | None = None  # a job whose end could not be written: a full disk, say
        while not self._stopping.is_set():
            job_id = unfinished
            try:
                if unfinished is not None:
                    self._end(unfinished, UNEXPECTED)
                    unfinished = None
                    continue
                job_id = self.rows.claim() if self._has_memory() else None
                if job_id is None:
                    self._wake.wait(1.0)
                    self._wake.clear()
                    continue
                self._run(job_id)
            except NotFound:
                _log.warning("job %s was deleted with its project", job_id)
                unfinished = None
            except Exception:  # the edge of a job: whatever it was, the queue goes on
                _log.exception("job %s", job_id)
                unfinished = job_id
                self._stopping.wait(1.0)

    def _has_memory(self) -> bool:
        """Whether a job may start now; the one that is next says why it waits."""
        free, needed = psutil.virtual_memory().available, self.settings.job_memory_bytes
        if free < needed:
            self.rows.next_waits(f"waits for memory: {free / 1e9:.1f} GB free, {needed / 1e9:.1f} GB needed")
        return free >= needed

    def _run(self, job_id: int) -> None:
        try:
            steps, log = self.rows.begin(job_id, self.commands)
            progress = JobProgress(steps)
            for number, step in enumerate(steps):
                progress.at(number)
                failure = self._run_step(job_id, step, progress, log)
                if failure is not None:
                    self._failed(job_id, failure)
                    return
                if self.rows.got_further(job_id, number + 1):
                    del self._deaths[job_id]
            self.rows.finish(job_id)
            self._forget(job_id)
        except ServerStops:
            self.rows.give_back(job_id)
        except (R2C2RError, OSError) as error:
            self._end(job_id, told(_said(error)))

    def _run_step(self, job_id: int, step: Step, progress: JobProgress, log: Path) -> dict[str, Any] | None:
        """Run one process; None when it did its work, else why not."""
        worker = Worker(step.command, log)
        with self._lock:
            self._workers[job_id] = worker
        try:
            self.rows.began_step(job_id, step.stage, log, worker, progress.overall, progress.eta_s)
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
        return outcome(last, status, step.stage)

    def _heard(self, job_id: int, step: Step, progress: JobProgress, fraction: float, words: str) -> None:
        progress.fraction = fraction
        if progress.is_due(STORE_EVERY_S):
            self._store(job_id, step, progress, words)

    def _silent(self, job_id: int, step: Step, progress: JobProgress) -> None:
        if progress.is_due(HEARTBEAT_S):
            self._store(job_id, step, progress, None)

    def _store(self, job_id: int, step: Step, progress: JobProgress, words: str | None) -> None:
        try:
            self.rows.progressed(job_id, step.stage, progress.fraction, words, progress.overall, progress.eta_s)
        except NotFound:  # it was deleted: there is nobody to work for
            self._cancelled.add(job_id)
        except R2C2RError as error:  # the work goes on also when nobody can be told how far it is
            _log.warning("job %s: %s", job_id, error)

    def _failed(self, job_id: int, failure: dict[str, Any]) -> None:
        """Try again when its process vanished, unless that happened too often at the same place."""
        if failure["kind"] == VANISHED and not self._was_cancelled(job_id):
            self._deaths[job_id] += 1  # a server that vanished is none of them
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
    """The error in one line with the next step."""
    if isinstance(error, R2C2RError):
        return error
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return NoSpace("the disk is full", hint="free some space and retry: finished stages are kept")
    return EnvironmentProblem(f"{error.filename or 'a file'}: {error.strerror or error}", hint="see the server's log")
