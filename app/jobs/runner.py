"""The queue: durable rows, one process per stage, at most `heavy_jobs` at a time.

A job belongs to the server that runs it. When a server dies, the next one ends what it left running and queues its jobs
again; finished stages are found in the workspace, so little is done twice.
"""

import errno
import logging
import os
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import psutil
from sqlalchemy import Engine, text
from sqlmodel import Session, col, select

from app.db.documents import inputs_key
from app.db.engine import reading, writing
from app.db.queries import STAGES, job_row, job_shape, project_row
from app.db.tables import Job, JobEvent, Project
from app.errors import KINDS, NoSpace, error_body
from app.files import ProjectFiles, project_files, require_free
from app.hub import Hub
from app.jobs.plans import Commands, Step, steps_of, write_request
from app.process import Worker, end_orphan, started_at
from app.settings import Settings
from r2c2r_core.errors import EnvironmentProblem, R2C2RError

_log = logging.getLogger(__name__)

POLL_S = 0.15
STORE_EVERY_S = 0.5
HEARTBEAT_S = 2.0
UNEXPECTED = {"kind": "internal", "message": "the queue met an unexpected error", "hint": "see the server's log, then retry"}

Finisher = Callable[[Session, Job, Project, ProjectFiles], None]


@dataclass(slots=True)
class _Progress:
    """How far a job is, and when it was last stored."""

    steps: list[Step]
    began: float = field(default_factory=time.monotonic)
    at_step: int = 0
    fraction: float = 0.0
    stored: float = 0.0
    beat: float = 0.0

    @property
    def overall(self) -> float:
        weights = [step.weight for step in self.steps]
        return (sum(weights[: self.at_step]) + weights[self.at_step] * self.fraction) / sum(weights)

    @property
    def eta_s(self) -> float | None:
        elapsed, overall = time.monotonic() - self.began, self.overall
        return round(elapsed * (1 - overall) / overall, 1) if overall > 0.02 and elapsed > 2 else None


class Runner:
    """Takes jobs from the table and runs them in threads that only wait for processes."""

    def __init__(
        self, engine: Engine, hub: Hub, settings: Settings, commands: Commands, finishers: dict[str, Finisher], failed: Finisher
    ) -> None:
        self.engine, self.hub, self.settings, self.commands = engine, hub, settings, commands
        self._finishers, self._failed = finishers, failed
        self._wake, self._stopping = threading.Event(), threading.Event()
        self._threads: list[threading.Thread] = []
        self._workers: dict[int, Worker] = {}
        self._cancelled: set[int] = set()
        self._lock = threading.Lock()

    def start(self) -> None:
        """Take up what an earlier server left, and begin."""
        self._recover()
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

    def wake(self) -> None:
        """Something was queued."""
        self._wake.set()

    def cancel(self, job_id: int) -> None:
        """Ask a job to stop; done at once when it only waits."""
        with self._lock, writing(self.engine) as session:
            row = job_row(session, job_id)
            if row.state == "queued":
                row.state, row.finished, row.message = "cancelled", time.time(), "cancelled before it started"
                self._note(session, row, "state", "cancelled")
                self._failed(session, row, project_row(session, row.project_id), self._files(session, row))
            elif row.state == "running":
                row.state, row.message = "cancelling", "stopping"
                self._cancelled.add(job_id)
                self._note(session, row, "state", "cancelling")
                if job_id in self._workers:
                    self._workers[job_id].ask_to_stop()
            session.add(row)
        self._tell(job_id)

    def wait_until_idle(self, project_id: str, timeout_s: float) -> bool:
        """Whether no process works for the project any more."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            with reading(self.engine) as session:
                busy = select(Job.id).where(Job.project_id == project_id, col(Job.state).in_(("running", "cancelling")))
                if session.exec(busy).first() is None:
                    return True
            time.sleep(0.02)
        return False

    def tell(self, job_id: int) -> None:
        """Show the job's row to every tab."""
        self._tell(job_id)

    def _recover(self) -> None:
        with writing(self.engine) as session:
            for row in session.exec(select(Job).where(col(Job.state).in_(("running", "cancelling")))):
                end_orphan(row.worker_pid, row.worker_started)
                row.worker_pid = row.worker_started = row.owner_pid = None
                if row.state == "cancelling":
                    row.state, row.finished = "cancelled", time.time()
                elif row.attempts >= self.settings.job_losses:
                    row.state, row.finished = "failed", time.time()
                    hint = "look at its log, then retry"
                    row.error = {
                        "kind": "interrupted",
                        "message": f"the server stopped {row.attempts} times during this job",
                        "hint": hint,
                    }
                else:
                    row.state, row.message = "queued", "taken up again after the server stopped"
                self._note(session, row, "state", row.message or row.state)
                if row.state in ("failed", "cancelled"):
                    self._failed(session, row, project_row(session, row.project_id), self._files(session, row))
                session.add(row)

    def _loop(self) -> None:
        unfinished: int | None = None  # a job whose end could not be written: a full disk, say
        while not self._stopping.is_set():
            job_id = unfinished
            try:
                if unfinished is not None:
                    self._end(unfinished, "failed", UNEXPECTED)
                    unfinished = None
                    continue
                job_id = self._claim() if self._has_memory() else None
                if job_id is None:
                    self._wake.wait(1.0)
                    self._wake.clear()
                    continue
                self._run(job_id)
            except Exception:  # the edge of a job: whatever it was, the queue goes on
                _log.exception("job %s", job_id)
                unfinished = job_id
                self._stopping.wait(1.0)

    def _has_memory(self) -> bool:
        """Whether a job may start now; the one that is next says why it waits."""
        free, needed = psutil.virtual_memory().available, self.settings.job_memory_bytes
        if free >= needed:
            return True
        with writing(self.engine) as session:
            row = session.exec(select(Job).where(Job.state == "queued").order_by(col(Job.id))).first()
            words = f"waits for memory: {free / 1e9:.1f} GB free, {needed / 1e9:.1f} GB needed"
            if row is None or row.message.startswith(words[:16]):
                return False
            row.message, number = words, row.id or 0
            session.add(row)
        self._tell(number)
        return False

    def _claim(self) -> int | None:
        """Take the oldest waiting job; no two threads or servers get the same one."""
        statement = text(
            "UPDATE jobs SET state='running', owner_pid=:pid, attempts=attempts+1, started=COALESCE(started, :now), "
            "heartbeat=:now, error=NULL, stage='', stage_fraction=0 "
            "WHERE id=(SELECT id FROM jobs WHERE state='queued' ORDER BY id LIMIT 1) RETURNING id"
        )
        with writing(self.engine) as session:
            found = session.execute(statement, {"pid": os.getpid(), "now": time.time()}).first()
        return int(found[0]) if found else None

    def _run(self, job_id: int) -> None:
        try:
            with writing(self.engine) as session:
                row = job_row(session, job_id)
                project = project_row(session, row.project_id)
                files = self._files(session, row)
                require_free(files.root, 0, self.settings.min_free_bytes)
                write_request(session, row, project, files)
                row.payload = {**row.payload, "inputs": inputs_key(session, project.id)}
                session.add(row)
                steps = steps_of(row, project, files, self.commands)
        except (R2C2RError, OSError) as error:
            self._end(job_id, "failed", error_body(_said(error)))
            return
        log = files.root / "logs" / f"job-{job_id}.log"
        progress = _Progress(steps)
        for number, step in enumerate(steps):
            progress.at_step, progress.fraction = number, 0.0
            outcome = self._run_step(job_id, step, progress, log)
            if outcome is not None:
                if outcome != {"stopped": True} and not self._take_up_again(job_id, outcome):
                    self._end(job_id, "cancelled" if self._was_cancelled(job_id) else "failed", outcome)
                return
            self._got_further(job_id, number + 1)
        self._finish(job_id)

    def _run_step(self, job_id: int, step: Step, progress: _Progress, log: Any) -> dict[str, Any] | None:
        """Run one process; None when it did its work, else why not."""
        try:
            worker = Worker(step.command, log)
        except OSError as error:
            return error_body(_said(error))
        with self._lock:
            self._workers[job_id] = worker
            if job_id in self._cancelled:
                worker.ask_to_stop()
        self._store(job_id, progress, step.stage, "", log_path=str(log), worker=worker)
        try:
            verdict = self._listen(job_id, worker, step, progress)
        finally:
            with self._lock:
                self._workers.pop(job_id, None)
            status = worker.close(self.settings.kill_grace_s)
        if self._stopping.is_set() and not self._was_cancelled(job_id) and "done" not in verdict:
            self._requeue(job_id)
            return {"stopped": True}
        if "error" in verdict:
            return dict(verdict["error"])
        if "done" in verdict:  # what it made is stored: how it left does not matter any more
            return None
        reason = f"signal {-status}" if status < 0 else f"exit status {status}"
        hint = "the system may have run out of memory; see the log" if status == -9 else "see the log"
        return {"kind": "worker-died", "message": f"{step.stage}: its process ended early ({reason})", "hint": hint}

    def _listen(self, job_id: int, worker: Worker, step: Step, progress: _Progress) -> dict[str, Any]:
        """Follow a worker to its last word."""
        asked: float | None = None
        while True:
            now = time.monotonic()
            if asked is None and (self._stopping.is_set() or self._was_cancelled(job_id)):
                worker.ask_to_stop()
                asked = now
            if asked is not None and now - asked > self.settings.kill_grace_s:
                worker.kill()
            try:
                line = worker.next_line(POLL_S)
            except queue.Empty:
                if now - progress.beat > HEARTBEAT_S:
                    self._store(job_id, progress, step.stage, None)
                continue
            if line is None:
                return {}
            if "done" in line or "error" in line:
                return line
            if line.get("stage") == step.stage:
                progress.fraction = min(max(float(line.get("fraction", 0.0)), 0.0), 1.0)
                if now - progress.stored > STORE_EVERY_S:
                    self._store(job_id, progress, step.stage, str(line.get("text", "")))

    def _store(
        self,
        job_id: int,
        progress: _Progress,
        stage: str,
        message: str | None,
        *,
        log_path: str | None = None,
        worker: Worker | None = None,
    ) -> None:
        progress.stored = progress.beat = time.monotonic()
        with writing(self.engine) as session:
            row = job_row(session, job_id)
            if worker is not None:
                row.log_path, row.worker_pid, row.worker_started = log_path, worker.pid, started_at(worker.pid)
                self._note(session, row, "stage", stage, stage=stage)
            elif message is not None:
                self._note(session, row, "progress", message, stage=stage, fraction=progress.fraction)
            row.stage, row.stage_fraction, row.heartbeat = stage, round(progress.fraction, 4), time.time()
            row.progress, row.eta_s = round(progress.overall, 4), progress.eta_s
            if message is not None and row.state == "running":
                row.message = message
            session.add(row)
        self._tell(job_id)

    def _finish(self, job_id: int) -> None:
        try:
            with writing(self.engine) as session:
                row = job_row(session, job_id)
                project = project_row(session, row.project_id)
                self._finishers[row.kind](session, row, project, self._files(session, row))
                row.state, row.finished, row.progress, row.stage_fraction = "done", time.time(), 1.0, 1.0
                row.stage, row.eta_s, row.worker_pid, row.error = STAGES[row.kind][-1], None, None, None
                self._note(session, row, "state", "done")
                session.add(row)
        except (R2C2RError, OSError) as error:
            self._end(job_id, "failed", error_body(_said(error)))
            return
        self._cancelled.discard(job_id)
        self._tell(job_id)
        self._tell_project(job_id)

    def _end(self, job_id: int, state: str, error: dict[str, Any]) -> None:
        with writing(self.engine) as session:
            row = job_row(session, job_id)
            row.state, row.finished, row.eta_s, row.worker_pid = state, time.time(), None, None
            row.error = None if state == "cancelled" else _plain_error(error)
            row.message = "cancelled; finished stages are kept" if state == "cancelled" else str(error["message"])
            self._note(session, row, "state" if state == "cancelled" else "error", row.message)
            self._failed(session, row, project_row(session, row.project_id), self._files(session, row))
            session.add(row)
        self._cancelled.discard(job_id)
        self._tell(job_id)
        self._tell_project(job_id)

    def _take_up_again(self, job_id: int, outcome: dict[str, Any]) -> bool:
        """Queue a job anew whose process vanished, unless that happened too often at the same place."""
        if outcome["kind"] != "worker-died" or self._was_cancelled(job_id):
            return False
        with writing(self.engine) as session:
            row = job_row(session, job_id)
            if row.attempts >= self.settings.job_attempts:
                return False
            row.state, row.worker_pid, row.owner_pid, row.eta_s = "queued", None, None, None
            row.message = "taken up again after its process ended early"
            self._note(session, row, "state", f"{outcome['message']}; taken up again")
            session.add(row)
        self._tell(job_id)
        self.wake()
        return True

    def _got_further(self, job_id: int, stages: int) -> None:
        with writing(self.engine) as session:
            row = job_row(session, job_id)
            if stages > row.reached:
                row.reached, row.attempts = stages, 1
                session.add(row)

    def _requeue(self, job_id: int) -> None:
        with writing(self.engine) as session:
            row = job_row(session, job_id)
            row.state, row.worker_pid, row.owner_pid, row.eta_s = "queued", None, None, None
            row.message, row.attempts = "waits for the server", max(row.attempts - 1, 0)
            session.add(row)

    def _was_cancelled(self, job_id: int) -> bool:
        return job_id in self._cancelled

    def _note(self, session: Session, row: Job, kind: str, words: str, *, stage: str = "", fraction: float = 0.0) -> None:
        line = JobEvent(
            job_id=row.id or 0, at=time.time(), kind=kind, stage=stage or row.stage, fraction=round(fraction, 4), text=words
        )
        session.add(line)

    def _files(self, session: Session, row: Job) -> ProjectFiles:
        project = project_row(session, row.project_id)
        return project_files(self.settings.data_dir, project.id, project.work_path)

    def _tell(self, job_id: int) -> None:
        with reading(self.engine) as session:
            row = session.get(Job, job_id)
            if row is not None:
                self.hub.publish("job", row.project_id, job=job_shape(session, row).model_dump())

    def _tell_project(self, job_id: int) -> None:
        with reading(self.engine) as session:
            row = session.get(Job, job_id)
            if row is not None:
                self.hub.publish("projects", None)
                self.hub.publish("project", row.project_id)


def _said(error: R2C2RError | OSError) -> R2C2RError:
    """The error in one line with the next step."""
    if isinstance(error, R2C2RError):
        return error
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return NoSpace("the disk is full", hint="free some space and retry: finished stages are kept")
    return EnvironmentProblem(f"{error.filename or 'a file'}: {error.strerror or error}", hint="see the server's log")


def _plain_error(error: dict[str, Any]) -> dict[str, Any]:
    """A worker's error in the app's words: class names become kinds."""
    by_class = {cls.__name__: kind for cls, kind, _ in KINDS}
    kind = str(error.get("kind", "error"))
    known = by_class.get(kind, kind if kind.islower() else "internal")
    return {"kind": known, "message": str(error.get("message", "")), "hint": str(error.get("hint", ""))}
