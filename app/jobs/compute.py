"""Where the processes of jobs run: on this machine, or where a Ray cluster has room."""

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
    """Starts the processes of jobs. Each is a Worker here, whatever stands behind it."""

    memory_bytes: int  # free on this machine before a job starts

    def ready(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """Have here what a job reads on this machine, of a project that is made by `holder` from now on.

        `taken`: it is another seat's job, or has been this one's, and a part of it is made here.
        """

    def start(self, job_id: int, project_id: str, step: Step, log: Path) -> Worker:
        """Start a step."""

    def start_part(self, part: Claimed, step: Step, files: ProjectFiles, log: Path) -> Worker:
        """Start a step for some objects, beside others of them; it ends with this process."""

    def ended(self, project_id: str) -> None:
        """Have here what a step made."""


class OwnMachine:
    """A process of this machine."""

    def __init__(self, settings: Settings, store: Store) -> None:
        self.memory_bytes, self._store = settings.job_memory_bytes, store

    def ready(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """All files, with the recording."""
        self._store.hold(project_id, holder, taken=taken)
        self._store.fetch(project_id, recording=True)

    def start(self, job_id: int, project_id: str, step: Step, log: Path) -> Worker:
        """The step's own process."""
        return Worker(step.command, log)

    def start_part(self, part: Claimed, step: Step, files: ProjectFiles, log: Path) -> Worker:
        """The same with a request of its own beside the log: that of the job is written for the machine that has it."""
        given = files.request(part.job_id)
        request = Path(shutil.copytree(given.parent, log.with_name("request")), given.name)
        placed_request(request, files)
        return Worker((*TETHERED, *step.of(part.names, request).command), log)

    def ended(self, project_id: str) -> None:
        """It was made here."""


class RayCluster:
    """A process of this machine that asks Ray for an actor, which starts the step's on its node (app.jobs.ray_relay).

    Whatever becomes of Ray ends that process alone, not this one.
    """

    memory_bytes = 256 * MEBIBYTE

    def __init__(self, settings: Settings, store: Store) -> None:
        self._settings, self._store = settings, store
        self._holders: dict[str, str] = {}  # by project

    def ready(self, project_id: str, holder: str, *, taken: bool = False) -> None:
        """The recording is read where the step runs."""
        self._store.hold(project_id, holder, taken=taken)
        self._holders[project_id] = holder
        self._store.fetch(project_id)

    def start(self, job_id: int, project_id: str, step: Step, log: Path) -> Worker:
        """The relay to a node with room for the step, which finds in the store what is here."""
        self._store.keep(project_id)
        return Worker(self._relay(job_id, project_id, step), log)

    def start_part(self, part: Claimed, step: Step, files: ProjectFiles, log: Path) -> Worker:
        """The relay to another node."""
        return Worker((*TETHERED, *self._relay(part.job_id, part.project_id, step.of(part.names))), log)

    def ended(self, project_id: str) -> None:
        """From the store."""
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
    """As the settings say it; raises InputError."""
    return RayCluster(settings, store) if settings.on_ray else OwnMachine(settings, store)
