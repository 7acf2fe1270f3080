"""A laboratory's deployment on one machine: two servers without compute, two seats, an object store, Ray; all can be killed."""

import contextlib
import json
import os
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import psutil
from kill_journey import Refused
from kill_server import ROOT, Server, kill_all
from sqlmodel import Session, col, func, select

from app.db.engine import opened, reading
from app.db.tables import Bundle, Job, JobEvent
from app.errors import Unavailable
from app.store.mirror import Mirror
from app.store.objects import open_objects
from tests.app.object_server import BUCKET, ObjectServer, object_server
from tests.app.postgres import PostgresServer, server
from tests.app.ray_cluster import RayNode, ray_node
from tests.ports import free_port

SEAT = """
import sys, threading
from pathlib import Path
from app.settings import Settings
from app.work import run_jobs
from app.jobs.plans import Commands
if sys.argv[2] == "real":
    commands = Commands()
else:
    from tests.app.conftest import FAKE_COMMANDS as commands
quick = {"beat_s": 0.5, "beats_missed_s": 6.0, "min_free_bytes": 0, "job_memory_bytes": 0}
run_jobs(Settings(data_dir=Path(sys.argv[1]), **quick), commands, threading.Event())
"""
KINDS = (
    "server",
    "the other server",
    "a seat",
    "a seat, frozen for a while",
    "a job's process",
    "the live segmenter",
    "the object store",
)
RAY = "Ray's node"
SEATS = 2  # the second computes on Ray where available
FROZEN_S = 8.0  # longer than the others wait for a heartbeat
STORE_IS_GONE_S = 2.0


class Lab:
    """A laboratory's deployment, whose parts can be killed and restarted."""

    def __init__(self, folder: Path, real: bool, rows: PostgresServer, store: ObjectServer, ray: RayNode | None) -> None:
        self.real, self.hits, self.kinds = real, Counter[str](), (*KINDS, *(RAY,) * (ray is not None))
        self._folder, self._store, self._ray = folder, store, ray
        self._database = rows.of_folder(folder)
        places = {"R2C2R_DATABASE": self._database, "R2C2R_STORE": f"s3://{BUCKET}/kills", "RUST_LOG": "error"}
        os.environ.update({**store.environment, **places})
        self._objects = open_objects(places["R2C2R_STORE"])
        self._webs = tuple(Server(folder / f"web-{number}", real) for number in range(2))
        self._first = self._webs[0]
        for web in self._webs:
            web.settings = {"heavy_jobs": 0, "beat_s": 0.5, "beats_missed_s": 6.0}
        self._seats: dict[int, subprocess.Popen] = {}
        self._thawing: list[threading.Timer] = []

    @property
    def runs(self) -> bool:
        """Whether a server answers."""
        return any(web.runs for web in self._webs)

    @property
    def whole(self) -> bool:
        """Whether every part runs."""
        parts = [self._store.process, *self._seats.values(), *([self._ray.process] if self._ray else [])]
        return all(web.runs for web in self._webs) and len(self._seats) == SEATS and all(part.poll() is None for part in parts)

    @property
    def host(self) -> str:
        """The host name that browsers use for both servers."""
        return self._first.host

    def address_for(self, path: str) -> str:
        """Route as the proxies of deploy/ do: to the last server that answered, if alive; parts of an upload to the same."""
        if path.startswith("/api/uploads"):
            return self._first.address
        if not self._webs[0].runs:
            self._webs = self._webs[::-1]
        return self._webs[0].address

    def start(self) -> None:
        """Start the parts that do not run."""
        if self._store.process.poll() is not None:
            time.sleep(STORE_IS_GONE_S)
            self._store.start()
        if self._ray is not None and self._ray.process.poll() is not None:
            self._ray.start()
        for web in self._webs:
            if not web.runs:
                web.start()
        for number in range(SEATS):
            if number not in self._seats or self._seats[number].poll() is not None:
                self._seats[number] = self._seat(number)

    def kill(self, what: str) -> None:
        """Kill a part; if that part is idle, kill the server that answers."""
        seats = [psutil.Process(seat.pid) for seat in self._seats.values() if seat.poll() is None]
        at_work = [seat for seat in seats if seat.children()]
        drawing = self._webs[0].workers("live")
        if what == "the object store":
            self._store.kill()
        elif what == RAY and self._ray is not None:
            self._ray.kill()
        elif what == "the other server":
            self._webs[1].kill("server")
        elif what == "the live segmenter" and drawing:
            kill_all(drawing)
        elif what == "a seat" and at_work:
            kill_all(at_work[:1])
            self._wait_for_seats()
        elif what == "a seat, frozen for a while" and at_work:
            self._freeze(at_work[0])
        elif what == "a job's process" and at_work:
            kill_all(at_work[0].children()[:1])
        else:
            what = "server"
            self._webs[0].kill(what)
        self.hits[what] += 1

    def stop(self) -> None:
        """Stop all parts."""
        for timer in self._thawing:
            timer.join()
        for web in self._webs:
            web.stop()
        for seat in self._seats.values():
            with contextlib.suppress(psutil.Error):
                kill_all([*psutil.Process(seat.pid).children(recursive=True), psutil.Process(seat.pid)])
            seat.wait()

    def stored(self, project: str) -> dict[str, str]:
        """The object store's files of the project: the digest of each file's content."""
        try:
            found = self._objects.read(f"projects/{project}/manifest.json")
        except Unavailable as error:
            raise Refused(503, str(error)) from error
        return {path: entry[0] for path, entry in json.loads(found.content)["files"].items()} if found else {}

    def digests(self, project: str, stage: str) -> dict[str, str]:
        """Digests of a stage's stored nouns."""
        within = f"work/nouns/{stage}/"
        return {path.removeprefix(within): sha for path, sha in self.stored(project).items() if path.startswith(within)}

    @contextlib.contextmanager
    def writing(self, project: str) -> Iterator[Path]:
        """A separate copy of the project's folder, as on a further machine, which is written back to the store."""
        mirror = Mirror(self._objects, self._folder / "by-hand")
        try:
            mirror.fetch(project)
            yield self._folder / "by-hand" / "projects" / project
            mirror.keep(project)
        except Unavailable as error:
            raise Refused(503, str(error)) from error

    def twice(self) -> list[str]:
        """Jobs that ended more than once, and bundles that belong to no job."""
        with opened(self._database) as engine, reading(engine) as session:
            return [*_ended_twice(session), *_too_many_bundles(session)]

    def _seat(self, number: int) -> "subprocess.Popen[bytes]":
        folder = self._folder / f"seat-{number}"
        folder.mkdir(exist_ok=True)
        command = [sys.executable, "-c", SEAT, str(folder), "real" if self.real else "fake"]
        on_ray = {"R2C2R_COMPUTE": "ray", **self._ray.environment} if self._ray and number == SEATS - 1 else {}
        environment = {**self._webs[0].environment(), **on_ray}
        return subprocess.Popen(command, env=environment, cwd=ROOT, stdout=subprocess.DEVNULL)

    def _freeze(self, seat: psutil.Process) -> None:
        """Suspend a seat in the middle of its work, and resume it after others have taken it for dead."""
        frozen = [seat, *seat.children(recursive=True)]
        for process in frozen:
            with contextlib.suppress(psutil.Error):
                process.suspend()
        self._thawing.append(threading.Timer(FROZEN_S, _thaw, (frozen,)))
        self._thawing[-1].start()

    def _wait_for_seats(self) -> None:
        for seat in self._seats.values():
            with contextlib.suppress(subprocess.TimeoutExpired):
                seat.wait(0.2)


@contextlib.contextmanager
def lab(folder: Path, *, real: bool, ray: bool) -> Iterator[Lab]:
    """A laboratory in a folder of its own."""
    with server() as rows, object_server() as store:
        known = {"RAY_GCS_SERVER_PORT": str(free_port()), "RUST_LOG": "error", **store.environment}  # fixed across restarts
        with ray_node(**known) if ray else contextlib.nullcontext() as node:
            yield Lab(folder, real, rows, store, node)


def _thaw(frozen: list[psutil.Process]) -> None:
    for process in frozen:
        with contextlib.suppress(psutil.Error):
            process.resume()


def _ended_twice(session: Session) -> list[str]:
    done = select(JobEvent.job_id, func.count()).where(JobEvent.kind == "state", JobEvent.text == "done")
    counted = session.exec(done.group_by(col(JobEvent.job_id)))
    return [f"job {job} was done {count} times" for job, count in counted if count > 1]


def _too_many_bundles(session: Session) -> list[str]:
    done = session.exec(select(func.count()).select_from(Job).where(Job.kind == "run", Job.state == "done")).one()
    bundles = session.exec(select(func.count()).select_from(Bundle)).one()
    return [f"{bundles} bundles of {done} runs that are done"] if bundles > done else []
