"""Pool of worker processes: `python -m r2c2r_core.pool FD` is one worker, with FD its socket to the parent process.

A worker lives as long as its pool, as importing takes a second or two, and its tasks share cached inputs. It ends when the
pool closes its end of the socket, or the parent process dies.
"""

import pickle
import signal
import socket
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from types import TracebackType
from typing import Any, NamedTuple

import psutil

from r2c2r_core.errors import Cancelled, EnvironmentProblem
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.threads import usable_cores

WORKER_BYTES = 1500 << 20  # memory per process: the measured peak was 1.1 GB, on samples of 180 and of 600 frames alike
_POLL_S = 0.2  # interval of checks for cancellation


class Task(NamedTuple):
    """A function of a module and its arguments, all picklable; it also takes `progress`."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]


class Failed(NamedTuple):
    """The exception of a task, with its traceback for the log."""

    error: Exception
    where: str


class WorkerLost(RuntimeError):
    """The process ended in the middle of a task."""


def usual_workers() -> int:
    """Default number of workers: limited by the available cores and memory."""
    room = psutil.virtual_memory().available // WORKER_BYTES
    return int(max(1, min(usable_cores(), room)))


@dataclass(slots=True, eq=False)
class Pool:
    """Up to `workers` processes, started on demand."""

    workers: int
    _idle: list["_Worker"] = field(default_factory=list)
    _busy: dict[Connection, "_Worker"] = field(default_factory=dict)

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for worker in (*self._idle, *self._busy.values()):
            worker.end()

    def run(self, tasks: Mapping[str, Task], progress: Progress = SILENT) -> Iterator[tuple[str, Any | Failed]]:
        """Each task's name and its result or Failed, in order of completion; raises Cancelled. A crashed process is a failure.

        The first tasks, one per process, start at the call; the others while the caller iterates over the results.
        """
        waiting = list(tasks.items())
        self._begin(waiting)
        return self._results(waiting, len(tasks), progress)

    def _begin(self, waiting: list[tuple[str, Task]]) -> None:
        while waiting and len(self._busy) < self.workers:
            worker = self._with(*waiting.pop(0))
            self._busy[worker.channel] = worker

    def _with(self, name: str, task: Task) -> "_Worker":
        """A worker that has the task: an idle one, unless it was killed meanwhile, else a new one."""
        while self._idle:
            worker = self._idle.pop()
            if worker.begin(name, task):
                return worker
            worker.end()
        worker = _Worker()
        worker.begin(name, task)  # one that ends at once is found lost when its answer is read
        return worker

    def _results(self, waiting: list[tuple[str, Task]], count: int, progress: Progress) -> Iterator[tuple[str, Any | Failed]]:
        shares: dict[str, float] = {}
        done = 0
        while waiting or self._busy:
            self._begin(waiting)
            for channel in wait(list(self._busy), _POLL_S):
                worker = self._busy[channel]  # type: ignore[index]  # these are the connections given
                kind, *content = worker.answer()
                if kind == "at":
                    shares[worker.name] = content[0]
                    progress.at((done + sum(shares.values())) / count, content[1])
                    continue
                del self._busy[worker.channel]
                shares.pop(worker.name, None)
                done += 1
                if kind != "lost":
                    self._idle.append(worker)
                yield worker.name, content[0] if kind == "done" else Failed(*content)
            progress.check()


class _Worker:
    """The pool's handle of one process."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        command = [sys.executable, "-m", "r2c2r_core.pool", str(theirs.fileno())]
        try:
            self._process = subprocess.Popen(command, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, stdout=2)
        except OSError as error:
            raise EnvironmentProblem(f"no worker process can be started ({error})", hint="set --workers 1") from error
        finally:
            theirs.close()
        self.channel = Connection(ours.detach())
        self.name = ""

    def begin(self, name: str, task: Task) -> bool:
        """Send a task to the idle worker; False if its process has ended."""
        self.name = name
        try:
            self.channel.send(task)
        except (BrokenPipeError, ConnectionResetError):
            return False
        return True

    def answer(self) -> tuple[Any, ...]:
        """("at", share, text), ("done", value), ("failed", error, where), or ("lost", error, where) of a dead process."""
        try:
            answer: tuple[Any, ...] = self.channel.recv()
        except (EOFError, OSError):
            self.channel.close()
            code = self._process.wait()
            ended = f"its process ended ({signal.Signals(-code).name if code < 0 else code})"
            return "lost", WorkerLost(f"{ended}, perhaps for lack of memory; try --workers 1"), ""
        return answer

    def end(self) -> None:
        """Kill the process at once, which is safe as results are stored atomically."""
        self.channel.close()
        self._process.kill()
        self._process.wait()


def main(arguments: Sequence[str]) -> int:
    """Run the tasks received through the socket, one after another, until it is closed."""
    for number in (signal.SIGINT, signal.SIGTERM):  # they reach the whole process group: the pool decides
        signal.signal(number, signal.SIG_IGN)
    channel = Connection(int(arguments[0]))
    progress = Progress(lambda _, fraction, text: channel.send(("at", fraction, text)), channel.poll)
    while True:
        try:
            task: Task = channel.recv()
            channel.send(_answer(task, progress))
        except (EOFError, BrokenPipeError, Cancelled):
            return 0


def _answer(task: Task, progress: Progress) -> tuple[Any, ...]:
    try:
        return "done", task.function(*task.arguments, progress=progress)
    except Cancelled:
        raise
    except Exception as error:  # the edge of a task: handled by the caller
        where = traceback.format_exc()
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # a library's exception that cannot be pickled
            error = RuntimeError(f"{type(error).__name__}: {error}")
        return "failed", error, where


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
