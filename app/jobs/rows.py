"""State transitions of a job's row: each is one transaction with an event, and published to all tabs."""

import os
import secrets
import socket
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from sqlalchemy import Engine, bindparam, text
from sqlmodel import Session, col, delete, or_, select, update

from app.db.engine import is_shared, now, reading, writing
from app.db.queries import READS_RECORDING, STAGES, job_row, job_shapes, note_size, project_row
from app.db.tables import Job, JobEvent, Part, Project
from app.errors import NotFound, told_body
from app.files import ProjectFiles, project_files, require_free
from app.hub import Hub
from app.jobs.durations import longest
from app.jobs.plans import Commands, Step, request_of, steps_of
from app.privacy import without_places
from app.process import Worker, end_orphan, started_at
from app.settings import Settings
from app.store.protocol import Store


def _nothing(session: Session, job: Job, project: Project, files: ProjectFiles) -> None:
    """No-op for finishers without files."""


class Finisher(NamedTuple):
    """Takeover of a finished job's results: files first, outside a transaction, then rows, in one transaction."""

    store: Callable[[Session, Job, Project, ProjectFiles, Any], None]  # the last is what `files` returned
    files: Callable[[Session, Job, Project, ProjectFiles], Any] = _nothing


Ender = Callable[[Session, Job, Project, ProjectFiles], None]

_CLAIM = (
    "UPDATE jobs SET state='running', owner=:owner, attempts=attempts+1, started=COALESCE(started, :now), "
    "heartbeat=:now, error=NULL, stage='', stage_fraction=0 "
    "WHERE id=(SELECT id FROM jobs AS waiting WHERE state='queued'{kinds} AND NOT EXISTS (SELECT 1 FROM jobs AS other "
    "WHERE other.project_id=waiting.project_id AND other.state IN ('running', 'cancelling')) ORDER BY id LIMIT 1{locked}) "
    "RETURNING id"
)
_AT_WORK = ("running", "cancelling")


class JobRows:
    """The table of jobs. `finishers` take over results of finished jobs, `ended` cleans up after unsuccessful ones.

    A running job belongs to its owner: a server that lost it, having been taken for dead, cannot change it any more.
    """

    def __init__(
        self, engine: Engine, hub: Hub, settings: Settings, store: Store, finishers: dict[str, Finisher], ended: Ender
    ) -> None:
        self.engine, self.hub, self.settings, self.store = engine, hub, settings, store
        self.owner = f"{socket.gethostname()}:{os.getpid()}:{secrets.token_hex(4)}"
        self.shared = is_shared(engine)
        locked = " FOR UPDATE SKIP LOCKED" if self.shared else ""
        self._claim = text(_CLAIM.format(kinds="", locked=locked))
        self._claim_import = text(_CLAIM.format(kinds=" AND kind IN :kinds", locked=locked)).bindparams(
            bindparam("kinds", READS_RECORDING, expanding=True)
        )
        self._finishers, self._ended = finishers, ended

    def recover(self) -> None:
        """Recover the jobs of dead servers: kill their workers and queue their jobs again.

        With a SQLite file, which has one server at a time, these are all running jobs; with a shared database, those without a
        heartbeat for long.
        """
        if not self.shared:
            self._forget_parts()
        with reading(self.engine) as session:
            left = self._left(session)
        if not left:
            return
        for row in filter(self._is_here, left):  # outside the transaction, which blocks other writers
            end_orphan(row.worker_pid, row.worker_started)
        with writing(self.engine) as session:
            left = self._left(session)
            for row in left:
                row.worker_pid = row.worker_started = row.owner = None
                if row.state == "cancelling":
                    row.state, row.finished = "cancelled", time.time()
                elif row.attempts >= self.settings.job_losses:
                    row.state, row.finished = "failed", time.time()
                    row.error = {
                        "kind": "interrupted",
                        "message": f"the server stopped {row.attempts} times during this job",
                        "hint": "look at its log, then retry",
                    }
                else:
                    row.state, row.message = "queued", "taken up again after the server stopped"
                _note(session, row, "state", row.message or row.state)
                if row.state in ("failed", "cancelled"):
                    self._leave(session, row)
                session.add(row)
        for row in left:
            self._tell_end(row.id or 0)

    def claim(self, *, imports_only: bool = False) -> int | None:
        """Claim the oldest waiting job whose project's workspace is idle; no two threads or servers get the same one."""
        claim = self._claim_import if imports_only else self._claim
        with writing(self.engine) as session:
            found = session.execute(claim, {"owner": self.owner, "now": now(session)}).first()
        return int(found[0]) if found else None

    def beat(self) -> dict[int, bool]:
        """Send a heartbeat; returns this server's jobs, and whether each is to be cancelled."""
        mine = update(Job).where(col(Job.owner) == self.owner, col(Job.state).in_(_AT_WORK))
        with writing(self.engine, lasting=False) as session:
            rows = session.execute(mine.values(heartbeat=now(session)).returning(col(Job.id), col(Job.state)))
            return {number: state == "cancelling" for number, state in rows}

    def next_waits(self, why: str) -> None:
        """Report once why the next job does not start; `why` has the same beginning for the same reason."""
        with writing(self.engine) as session:
            row = session.exec(select(Job).where(Job.state == "queued").order_by(col(Job.id))).first()
            if row is None or row.message.startswith(why[:16]):
                return
            row.message, number = why, row.id or 0
            session.add(row)
        self.tell(number)

    def project_of(self, job_id: int) -> str:
        """The project of a job that this server runs."""
        with reading(self.engine) as session:
            return self._own(session, job_id).project_id

    def begin(self, job_id: int, commands: Commands) -> tuple[list[Step], Path]:
        """Write the job's request; returns its steps and log. Raises NoSpace on a full disk."""
        with writing(self.engine) as session:
            row = self._own(session, job_id)
            project = project_row(session, row.project_id)
            files = self._files(session, row)
            require_free(files.root, 0, self.settings.min_free_bytes)
            given = request_of(session, row, project, files)
            row.payload = {**row.payload, "inputs": given["inputs"]}
            session.add(row)
            took, steps = longest(session, row), steps_of(row, project, files, commands)
            return [replace(step, took_s=took.get(step.stage)) for step in steps], files.root / "logs" / f"job-{job_id}.log"

    def is_cancelling(self, job_id: int) -> bool:
        """Whether cancellation of a job running here was requested at any server."""
        with reading(self.engine) as session:
            return self._own(session, job_id).state == "cancelling"

    def step_of(self, job_id: int, stage: str, commands: Commands) -> tuple[Step, ProjectFiles]:
        """A step of a job running at any process, and its local files."""
        with reading(self.engine) as session:
            row = job_row(session, job_id)
            files = self._files(session, row)
            steps = steps_of(row, project_row(session, row.project_id), files, commands)
        return next(step for step in steps if step.stage == stage), files

    def began_step(
        self, job_id: int, stage: str, fraction: float, log: Path, worker: Worker, progress: float, eta_s: float | None
    ) -> None:
        """Record the start of a process; the first one of a stage, at fraction 0, marks the stage's beginning."""
        began = started_at(worker.pid)
        with writing(self.engine) as session:
            row = self._own(session, job_id)
            row.log_path, row.worker_pid, row.worker_started = str(log), worker.pid, began
            if fraction == 0.0:
                _note(session, row, "stage", stage, stage=stage)
            _set_progress(session, row, stage, fraction, progress, eta_s)
            if row.state == "running" and fraction == 0.0:
                row.message = ""
        self.tell(job_id)

    def progressed(
        self, job_id: int, stage: str, fraction: float, message: str | None, progress: float, eta_s: float | None
    ) -> None:
        """Store the progress; without a message, only as a sign of life."""
        with writing(self.engine, lasting=False) as session:
            row = self._own(session, job_id)
            if message is not None:
                _note(session, row, "progress", message, stage=stage, fraction=fraction)
                row.message = message if row.state == "running" else row.message
            _set_progress(session, row, stage, fraction, progress, eta_s)
        self.tell(job_id)

    def got_further(self, job_id: int, stages: int) -> bool:
        """Store the number of finished stages; returns whether it is a new maximum, which resets the attempts."""
        with writing(self.engine) as session:
            row = self._own(session, job_id)
            further = stages > row.reached
            if further:
                row.reached, row.attempts = stages, 1
                session.add(row)
        return further

    def finish(self, job_id: int) -> str:
        """Take over a finished job's results and return its kind. Errors of the finisher propagate, with nothing stored."""
        with reading(self.engine) as session:
            row = self._own(session, job_id)
            finisher, files = self._finishers[row.kind], self._files(session, row)
            made = finisher.files(session, row, project_row(session, row.project_id), files)
        self.store.keep(row.project_id)  # everything, before a row refers to it, as this machine may die afterwards
        size = self.store.size(row.project_id)
        with writing(self.engine) as session:
            row = self._own(session, job_id)
            note_size(session, row.project_id, size)
            finisher.store(session, row, project_row(session, row.project_id), files, made)
            row.state, row.finished, row.progress, row.stage_fraction = "done", time.time(), 1.0, 1.0
            row.stage, row.eta_s, row.worker_pid, row.error = STAGES[row.kind][-1], None, None, None
            _note(session, row, "state", "done")
            session.add(row)
            kind = row.kind
        self._tell_end(job_id)
        return kind

    def end(self, job_id: int, state: str, error: dict[str, Any]) -> None:
        """Mark the job as failed or cancelled."""
        with writing(self.engine) as session:
            row = self._own(session, job_id)
            row.state, row.finished, row.eta_s, row.worker_pid = state, time.time(), None, None
            error = {k: without_places(v, self.settings) if isinstance(v, str) else v for k, v in error.items()}
            row.error = None if state == "cancelled" else told_body(error)
            row.message = "cancelled; finished stages are kept" if state == "cancelled" else str(error["message"])
            _note(session, row, "state" if state == "cancelled" else "error", row.message)
            self._leave(session, row)
            session.add(row)
        self._tell_end(job_id)

    def queue_again(self, job_id: int, why: str) -> None:
        """Queue the job for another try after its process vanished."""
        with writing(self.engine) as session:
            row = self._own(session, job_id)
            _set_waiting(session, row, "taken up again after its process ended early")
            _note(session, row, "state", f"{why}; taken up again")
        self.tell(job_id)

    def give_back(self, job_id: int, why: str) -> None:
        """Queue the job for the next server or until a resource is available, without counting a failed attempt."""
        with writing(self.engine) as session:
            row = self._own(session, job_id)
            row.attempts = max(row.attempts - 1, 0)
            _set_waiting(session, row, why)

    def cancel(self, job_id: int) -> bool:
        """Cancel a waiting job; returns whether it runs here and must be stopped."""
        with writing(self.engine) as session:
            row = job_row(session, job_id)
            running, here = row.state == "running", row.owner == self.owner
            if row.state == "queued":
                row.state, row.finished, row.message = "cancelled", time.time(), "cancelled before it started"
                _note(session, row, "state", "cancelled")
                self._leave(session, row)
            elif running:
                row.state, row.message = "cancelling", "stopping"
                _note(session, row, "state", "cancelling")
            session.add(row)
        self.tell(job_id)
        return running and here

    def busy(self, project_id: str) -> bool:
        """Whether a job process is running for the project."""
        with reading(self.engine) as session:
            query = select(Job.id).where(Job.project_id == project_id, col(Job.state).in_(_AT_WORK))
            return session.exec(query).first() is not None

    def tell(self, job_id: int) -> None:
        """Publish the row to all tabs."""
        with reading(self.engine) as session:
            row = session.get(Job, job_id)
            if row is not None:
                self.hub.publish("job", row.project_id, job=job_shapes(session, [row])[0].model_dump())

    def _forget_parts(self) -> None:
        with reading(self.engine) as session:
            if session.exec(select(Part.id).limit(1)).first() is None:
                return
        with writing(self.engine) as session:
            session.execute(delete(Part))

    def _left(self, session: Session) -> list[Job]:
        """Running jobs whose owner is gone."""
        of = select(Job).where(col(Job.state).in_(_AT_WORK))
        if self.shared:
            silent_since = now(session) - self.settings.beats_missed_s
            of = of.where(or_(col(Job.heartbeat).is_(None), col(Job.heartbeat) < silent_since))
        return list(session.exec(of))

    def _is_here(self, row: Job) -> bool:
        """Whether the job's worker process was on this machine."""
        return not self.shared or (row.owner or "").startswith(f"{socket.gethostname()}:")

    def _own(self, session: Session, job_id: int) -> Job:
        """A job that this server runs; raises NotFound where there is none, or another server has taken it over."""
        row = job_row(session, job_id)
        if row.owner != self.owner:
            raise NotFound(f"job {job_id} is run by {row.owner or 'nobody'} now, where {self.owner} ran it")
        return row

    def _tell_end(self, job_id: int) -> None:
        self.tell(job_id)
        with reading(self.engine) as session:
            row = session.get(Job, job_id)
        if row is not None:
            self.hub.publish("projects", None)
            self.hub.publish("project", row.project_id)

    def _leave(self, session: Session, row: Job) -> None:
        self._ended(session, row, project_row(session, row.project_id), self._files(session, row))

    def _files(self, session: Session, row: Job) -> ProjectFiles:
        project = project_row(session, row.project_id)
        return project_files(self.settings.data_dir, project.id, project.work_path)


def _set_progress(session: Session, row: Job, stage: str, fraction: float, progress: float, eta_s: float | None) -> None:
    row.stage, row.stage_fraction, row.heartbeat = stage, round(fraction, 4), now(session)
    row.progress, row.eta_s = round(progress, 4), eta_s
    session.add(row)


def _set_waiting(session: Session, row: Job, message: str) -> None:
    row.state, row.message = "queued", message
    row.worker_pid, row.owner, row.eta_s = None, None, None
    session.add(row)


def _note(session: Session, row: Job, kind: str, words: str, *, stage: str = "", fraction: float = 0.0) -> None:
    event = JobEvent(job_id=row.id or 0, at=time.time(), kind=kind, text=words)
    event.stage, event.fraction = stage or row.stage, round(fraction, 4)
    session.add(event)
