"""A worker process with a JSON-lines protocol, in its own process group, so that stopping it stops its children too."""

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import psutil

import app

Line = dict[str, Any]


class Lines:
    """Queue of a worker's messages in order; after the last one it always returns None."""

    def __init__(self) -> None:
        self._queue: queue.Queue[Line | None] = queue.Queue()

    def put(self, line: Line | None) -> None:
        """Add a message; None after the last."""
        self._queue.put(line)

    def next(self, timeout: float) -> Line | None:
        """The next message; raises queue.Empty after the timeout."""
        line = self._queue.get(timeout=timeout)
        if line is None:
            self._queue.put(None)  # for further calls
        return line


class Worker:
    """A running worker. Its stderr, and any non-JSON output on stdout, goes to the log.

    It has its own temporary folder, which is deleted when it ends in any way.
    """

    def __init__(self, command: Sequence[str], log: Path) -> None:
        log.parent.mkdir(parents=True, exist_ok=True)
        self._log: IO[bytes] = log.open("ab")
        self._lines = Lines()
        self._temporary = tempfile.TemporaryDirectory(prefix="r2c2r-worker-")
        self.process = subprocess.Popen(
            list(command),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            start_new_session=True,
            env=_environment() | {"TMPDIR": self._temporary.name},
        )
        self._reader = threading.Thread(target=self._read, name=f"worker-{self.process.pid}", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """The worker's process id, which is also its group's."""
        return self.process.pid

    @property
    def alive(self) -> bool:
        """Whether the worker is still running."""
        return self.process.poll() is None

    def next_line(self, timeout: float) -> Line | None:
        """The next message; raises queue.Empty after the timeout; None after the worker's last message."""
        return self._lines.next(timeout)

    def say(self, message: Line) -> bool:
        """Send the worker a message; False when it has ended."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps(message).encode() + b"\n")
            self.process.stdin.flush()
        except (OSError, ValueError):
            return False
        return True

    def ask_to_stop(self) -> None:
        """SIGTERM to the whole group."""
        _signal_group(self.pid, signal.SIGTERM)

    def kill(self) -> None:
        """SIGKILL to the whole group."""
        _signal_group(self.pid, signal.SIGKILL)

    def close(self, grace_s: float = 0.0) -> int:
        """Wait for the worker to end, kill it after the grace period, and return its exit status."""
        try:
            self.process.wait(timeout=grace_s if grace_s > 0 else 0.001)
        except subprocess.TimeoutExpired:
            self.kill()
        status = self.process.wait()
        self.kill()  # its children may outlive it
        self._reader.join(timeout=5)
        for stream in (self.process.stdin, self.process.stdout, self._log):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()
        with contextlib.suppress(OSError):  # a disk that fails
            self._temporary.cleanup()
        return status

    def _read(self) -> None:
        assert self.process.stdout is not None
        with contextlib.suppress(ValueError):  # closed under us
            for raw in self.process.stdout:
                self._take(raw)
        self._lines.put(None)

    def _take(self, raw: bytes) -> None:
        try:
            line = json.loads(raw)
        except ValueError:
            line = None
        if isinstance(line, dict):
            self._lines.put(line)
        else:
            with contextlib.suppress(OSError):  # a full disk must not stop us listening
                self._log.write(raw)


class Workers:
    """Workers that requests wait for, all killed at once when the server stops, which ends the waits."""

    def __init__(self) -> None:
        self.stopped = False
        self._running: set[Worker] = set()

    @contextmanager
    def running(self, command: Sequence[str], log: Path) -> Iterator[Worker]:
        """A worker that ends with this block, or with the server; an ended one if the server is already stopping."""
        worker = Worker(command, log)
        self._running.add(worker)
        if self.stopped:  # checked after adding: either stop() sees the worker, or this check sees that stop() was called
            worker.kill()
        try:
            yield worker
        finally:
            worker.close()
            self._running.discard(worker)

    def stop(self) -> None:
        """Kill running and future workers; takes no lock, as a waiting caller may hold any."""
        self.stopped = True
        for worker in tuple(self._running):
            worker.kill()


def python_module(*words: str) -> tuple[str, ...]:
    """Command that runs one of the project's modules."""
    return (sys.executable, "-m", *words)


def started_at(pid: int) -> float | None:
    """Creation time of the process, or None; a pid alone may have been reused."""
    try:
        return float(psutil.Process(pid).create_time())
    except psutil.Error:
        return None


def end_orphan(pid: int | None, started: float | None) -> None:
    """Kill the group of a worker whose server has died, if the pid is still that worker."""
    if pid is None or started is None:
        return
    now = started_at(pid)
    if now is not None and abs(now - started) < 1.0:
        _signal_group(pid, signal.SIGKILL)


def _signal_group(pid: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, number)


def _environment() -> dict[str, str]:
    root = str(Path(app.__file__).resolve().parent.parent)
    known = os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONPATH": f"{root}{os.pathsep}{known}" if known else root}
