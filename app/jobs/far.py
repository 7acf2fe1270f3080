"""Remote live segmenters: the session stays at the web server, its process runs at a seat of `r2c2r work --live`.

Commands and messages are sent through the channel between servers. A seat reports its number of segmenters with each
heartbeat; a server starts the next one at the seat with the fewest. If either side vanishes, the other ends its part.
"""

import base64
import logging
import queue
import secrets
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from app.db.channel import Channel
from app.errors import told
from app.files import ProjectFiles, project_files
from app.jobs.elevation_files import INDEX
from app.jobs.plans import Commands
from app.process import Line, Lines, Worker
from app.settings import Settings
from app.store.protocol import Store
from r2c2r_core.errors import EnvironmentProblem, R2C2RError
from r2c2r_core.workspace import write_atomically

_log = logging.getLogger(__name__)

LOOK_S = 5.0
ELEVATIONS = "--elevations"


class FarWorker:
    """A worker at a seat, with the interface of `app.process.Worker`."""

    def __init__(self, channel: Channel, seat: str, files: ProjectFiles) -> None:
        self.seat, self.id, self.alive = seat, secrets.token_hex(8), True
        self._channel, self._files = channel, files
        self._lines = Lines()

    def next_line(self, timeout: float) -> Line | None:
        """The next message; raises queue.Empty after the timeout; None after the worker's last message."""
        return self._lines.next(timeout)

    def say(self, message: Line) -> bool:
        """Send the worker a message; False when it has ended."""
        self.tell("live-say", line=message)
        return self.alive

    def kill(self) -> None:
        """End the worker."""
        self.tell("live-stop")
        self.ended()

    def close(self) -> int:
        """End the worker if it is running."""
        if self.alive:
            self.kill()
        return 0

    def tell(self, kind: str, **said: Any) -> None:
        """Send a message about it to its seat."""
        self._channel.say(kind, {"to": self.seat, "id": self.id, **said})

    def hear(self, line: Line) -> None:
        """Handle a message of the worker; its pictures of the scan come as files."""
        if "file" in line:
            write_atomically(self._files.elevations / line["file"], base64.b64decode(line["bytes"]))
        else:
            self._lines.put(line)

    def ended(self) -> None:
        """Mark the worker as ended."""
        self.alive = False
        self._lines.put(None)


class FarWorkers:
    """Remote workers started by this server."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._seats: dict[str, int] = {}  # number of workers by seat
        self._workers: dict[str, FarWorker] = {}
        self._lock = threading.Lock()
        channel.hears |= {"live-seat": self._offered, "live-line": self._said, "live-end": self._ended}
        channel.on_gone.append(lambda seat, _vanished: self._gone(seat))
        channel.on_gap.append(self._miss)

    def start(self, project: str, files: ProjectFiles, options: tuple[str, ...]) -> FarWorker | None:
        """Start a worker for the project; None where no seat is available, or the project's files are only on this machine."""
        if files.work.parent != files.root:
            return None
        with self._lock:  # a seat that leaves meanwhile ends its workers
            if not self._seats:
                return None
            worker = FarWorker(self._channel, min(self._seats, key=self._seats.__getitem__), files)
            self._workers[worker.id] = worker
            self._seats[worker.seat] += 1  # until it reports the number itself
        files.elevations.mkdir(parents=True, exist_ok=True)
        worker.tell("live-start", project=project, options=options)
        return worker

    def _offered(self, seat: str, said: dict[str, Any]) -> None:
        self._seats[seat] = said["runs"]

    def _said(self, _seat: str, said: dict[str, Any]) -> None:
        if worker := self._workers.get(said["id"]):
            worker.hear(said["line"])

    def _ended(self, _seat: str, said: dict[str, Any]) -> None:
        if worker := self._workers.pop(said["id"], None):
            worker.ended()

    def _miss(self) -> None:
        """Restart all workers, as messages may be lost."""
        for worker in tuple(self._workers.values()):
            worker.kill()
        self._workers.clear()

    def _gone(self, seat: str) -> None:
        with self._lock:
            self._seats.pop(seat, None)
            lost = [worker for worker in self._workers.values() if worker.seat == seat]
            for worker in lost:
                del self._workers[worker.id]
        for worker in lost:
            worker.ended()


class LiveSeat:
    """Seat that runs live segmenters for servers."""

    def __init__(self, channel: Channel, store: Store, settings: Settings, commands: Commands) -> None:
        self._channel, self._store, self._settings, self._commands = channel, store, settings, commands
        self._workers: dict[
            str, tuple[str, Worker | None]
        ] = {}  # by id: the server that started it, and the worker, None while its files are fetched
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._projects: dict[str, str] = {}
        channel.hears |= {"live-start": self._start, "live-say": self._say, "live-stop": self._stop}
        channel.on_gone.append(lambda server, _vanished: self._end(lambda begun_by: begun_by == server))
        channel.on_gap.append(lambda: self._end(lambda _: True))
        channel.beats.append(self._offer)

    @property
    def projects(self) -> frozenset[str]:
        """Projects with a live segmenter here."""
        return frozenset(self._projects.copy().values())

    def stop(self) -> None:
        """End all workers."""
        self._end(lambda _: True)
        for thread in self._threads:
            thread.join()

    def _offer(self) -> None:
        self._channel.say("live-seat", {"runs": len(self._workers)})

    def _start(self, server: str, said: dict[str, Any]) -> None:
        if said["to"] != self._channel.name:
            return
        with self._lock:
            self._workers[said["id"]] = server, None
            self._projects[said["id"]] = said["project"]
        self._offer()
        asked = server, said["id"], said["project"], tuple(said["options"])
        self._threads = [thread for thread in self._threads if thread.is_alive()]
        self._threads.append(threading.Thread(target=self._run, args=asked, name=f"live-{said['project']}", daemon=True))
        self._threads[-1].start()

    def _say(self, _server: str, said: dict[str, Any]) -> None:
        _, worker = self._workers.get(said["id"], ("", None))
        if worker is not None:  # a session sends nothing before it is ready
            worker.say(said["line"])

    def _stop(self, _server: str, said: dict[str, Any]) -> None:
        with self._lock:
            _, worker = self._workers.pop(said["id"], ("", None))
        if worker is not None:
            worker.kill()

    def _end(self, of: Callable[[str], bool]) -> None:
        for number in [number for number, (server, _) in self._workers.copy().items() if of(server)]:
            self._stop("", {"id": number})

    def _run(self, server: str, number: str, project: str, options: tuple[str, ...]) -> None:
        """Run one worker from its start to its end."""
        try:
            self._store.fetch(project)
            self._relay(server, number, project, options)
            self._store.keep(project)  # a run on any machine continues from what it prepared
        except (R2C2RError, OSError) as error:
            said = error if isinstance(error, R2C2RError) else EnvironmentProblem(f"the seat: {error}", hint="see its log")
            self._tell(server, "live-line", id=number, line={"state": "failed", "error": told(said)})
        except Exception:  # the edge of a thread: any failure ends only this worker
            _log.exception("live masks of %s", project)
        with self._lock:
            self._workers.pop(number, None)
            self._projects.pop(number, None)
        self._tell(server, "live-end", id=number)
        self._offer()

    def _relay(self, server: str, number: str, project: str, options: tuple[str, ...]) -> None:
        files = project_files(self._settings.data_dir, project, None)
        places = str(files.work), *options, ELEVATIONS, str(files.elevations)
        worker = Worker((*self._commands.live, *places), files.root / "logs" / "live.log")
        with self._lock:
            wanted = number in self._workers
            if wanted:
                self._workers[number] = server, worker
        try:
            while wanted and (line := _next(worker)) is not None:
                if line.get("state") == "ready" and self._settings.store:  # else the folder is the server's too
                    for path in sorted(files.elevations.iterdir(), key=lambda path: path.name == INDEX):
                        content = base64.b64encode(path.read_bytes()).decode()
                        self._tell(server, "live-line", id=number, line={"file": path.name, "bytes": content})
                self._tell(server, "live-line", id=number, line=line)
        finally:
            worker.close()

    def _tell(self, server: str, kind: str, **said: Any) -> None:
        self._channel.say(kind, {"to": server, **said})


def _next(worker: Worker) -> Line | None:
    while True:
        with suppress(queue.Empty):
            return worker.next_line(LOOK_S)
