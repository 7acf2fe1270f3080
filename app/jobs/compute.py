"""Execution backends for job processes: this machine, or a Ray cluster."""

import json
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Protocol

from app.files import ProjectFiles
from app.jobs.parts import Claimed
from app.jobs.plans import Step, placed_request
from app.jobs.ray_order import Order
from app.jobs.seats import version
from app.process import Worker, python_module
from app.settings import MEBIBYTE, Settings
from app.store.protocol import Store
from r2c2r_core.pool import WORKER_BYTES

TETHERED = python_module("app.tethered")


class Seat(Protocol):
    """Protocol for starting job processes, each represented by a local Worker."""

    memory_bytes: int  # free on this machine before a job starts

    def ready(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Fetch the files that a job reads on this machine, and make `holder` the project's writer.

        `taken`: the job belongs to another seat, or has been this one's, and a part of it is computed here.
        """

    def start(self, job_id: int, project_id: str, step: Step, log: Path) -> Worker:
        """Start a step."""

    def start_part(self, part: Claimed, step: Step, files: ProjectFiles, log: Path) -> Worker:
        """Start a step for some objects, in parallel with others; it ends with this process."""

    def ended(self, project_id: str) -> None:
        """Fetch the results of a step."""


class OwnMachine:
    """Backend that runs processes on this machine."""

    def __init__(self, settings: Settings, store: Store) -> None:
        self.memory_bytes, self._store = settings.job_memory_bytes, store

    def ready(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Fetch all files, with the recording."""
        self._store.hold(project_id, holder, taken=taken)
        self._store.fetch(project_id, recording=True)

    def start(self, job_id: int, project_id: str, step: Step, log: Path) -> Worker:
        """Start the step's process."""
        return Worker(step.command, log)

    def start_part(self, part: Claimed, step: Step, files: ProjectFiles, log: Path) -> Worker:
        """The same with a separate request beside the log, as the job's request has paths of the owner's machine."""
        given = files.request(part.job_id)
        request = Path(shutil.copytree(given.parent, log.with_name("request")), given.name)
        placed_request(request, files)
        return Worker((*TETHERED, *step.of(part.names, request).command), log)

    def ended(self, project_id: str) -> None:
        """Nothing to do: results are local."""


class RayCluster:
    """Backend that starts a local relay process, which requests a Ray actor to run the step on a node (app.jobs.ray_relay).

    A failure of Ray ends only that process, not this one.
    """

    memory_bytes = 256 * MEBIBYTE

    def __init__(self, settings: Settings, store: Store) -> None:
        self._settings, self._store = settings, store
        self._holders: dict[str, str] = {}  # by project

    def ready(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Fetch all files but the recording, which is read where the step runs."""
        self._store.hold(project_id, holder, taken=taken)
        self._holders[project_id] = holder
        self._store.fetch(project_id)

    def start(self, job_id: int, project_id: str, step: Step, log: Path) -> Worker:
        """Upload local files and start the relay to a node with resources for the step."""
        self._store.keep(project_id)
        return Worker(self._relay(job_id, project_id, step), log)

    def start_part(self, part: Claimed, step: Step, files: ProjectFiles, log: Path) -> Worker:
        """Start a relay to another node."""
        return Worker((*TETHERED, *self._relay(part.job_id, part.project_id, step.of(part.names))), log)

    def ended(self, project_id: str) -> None:
        """Fetch results from the store."""
        self._store.fetch(project_id)

    def _relay(self, job_id: int, project_id: str, step: Step) -> tuple[str, ...]:
        return (*python_module("app.jobs.ray_relay"), json.dumps(asdict(self._order(job_id, project_id, step))))

    def _order(self, job_id: int, project_id: str, step: Step) -> Order:
        settings, workers = self._settings, self._settings.workers_a_job if step.side_by_side else 1
        return Order(
            version=version(),
            job=job_id,
            project=project_id,
            holder=self._holders[project_id],
            stage=step.stage,
            command=step.command,
            data_dir=str(settings.data_dir),
            store=settings.store,
            cache_gb=settings.cache_gb,
            cpus=workers,
            gpu=step.learned,
            memory_bytes=settings.job_memory_bytes + (workers - 1) * WORKER_BYTES,
            grace_s=settings.kill_grace_s,
        )


def seat_of(settings: Settings, store: Store) -> Seat:
    """The backend selected by the settings; raises InputError."""
    return RayCluster(settings, store) if settings.on_ray else OwnMachine(settings, store)
