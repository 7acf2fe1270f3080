"""A server that is restarted whenever it was killed, always at the same address."""

import contextlib
import hashlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import httpx2 as httpx
import psutil
from waiting import until

ROOT = Path(__file__).resolve().parent.parent
SERVER = """
import json, sys, uvicorn
from pathlib import Path
from app.main import create_app
from app.settings import Settings
from app.jobs.plans import Commands
data, port, real = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3] == "real"
if real:
    commands = Commands()
else:
    from tests.app.conftest import FAKE_COMMANDS as commands
usual = {"launch_token": "key", "min_free_bytes": 0, "job_memory_bytes": 0, "import_roots": (data.parent,)}
settings = Settings(data_dir=data, **usual, **json.loads(sys.argv[4]))
uvicorn.run(create_app(settings, commands=commands), host="127.0.0.1", port=port, log_level="critical")
"""


class SetUp(Protocol):
    """The deployment under test: everything that serves one user and computes for them."""

    real: bool
    kinds: tuple[str, ...]  # names of the parts that can be killed
    hits: Counter[str]

    @property
    def runs(self) -> bool:
        """Whether a server answers."""

    @property
    def whole(self) -> bool:
        """Whether every part runs."""

    @property
    def host(self) -> str:
        """The host name that browsers use."""

    def address_for(self, path: str) -> str:
        """The address of the server responsible for the path."""

    def start(self) -> None:
        """Start the parts that do not run, and wait until a server answers."""

    def kill(self, what: str) -> None:
        """Kill a part."""

    def writing(self, project: str) -> contextlib.AbstractContextManager[Path]:
        """The project's folder, for writing results that a job would have made."""

    def digests(self, project: str, stage: str) -> dict[str, str]:
        """The stored outputs of a stage: the digest of each noun."""

    def twice(self) -> list[str]:
        """Work that was done twice, as far as that can be detected."""

    def stop(self) -> None:
        """Stop all parts."""


class Server:
    """A single server on a data folder."""

    kinds: tuple[str, ...] = ("server", "server and workers", "a job's process", "the live segmenter")

    def __init__(self, data: Path, real: bool) -> None:
        self.data, self.real, self.port = data, real, 0
        self.process: subprocess.Popen | None = None
        self.hits: Counter[str] = Counter()
        self.settings: dict[str, Any] = {}

    @property
    def runs(self) -> bool:
        """Whether its process runs."""
        return self.process is not None and self.process.poll() is None

    @property
    def whole(self) -> bool:
        """Whether every part runs."""
        return self.runs

    @property
    def address(self) -> str:
        """Its address."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def host(self) -> str:
        """The host name that browsers use."""
        return f"127.0.0.1:{self.port}"

    def address_for(self, path: str) -> str:
        """Its own address, for every path."""
        return self.address

    def environment(self) -> dict[str, str]:
        """Environment variables of its processes."""
        return {**os.environ, "PYTHONPATH": str(ROOT)}

    def start(self) -> None:
        """Start it and wait until it answers."""
        if not self.port:
            with socket.create_server(("127.0.0.1", 0)) as free:
                self.port = free.getsockname()[1]
        self.process = self.begin()
        until(lambda: self._answers(), 120)

    def begin(self) -> subprocess.Popen:
        """Start its process without waiting until it answers."""
        words = [sys.executable, "-c", SERVER, str(self.data), str(self.port), "real" if self.real else "fake"]
        return subprocess.Popen([*words, json.dumps(self.settings)], env=self.environment(), cwd=ROOT)

    def workers(self, *names: str) -> list[psutil.Process]:
        """Its running workers whose command line contains one of the names."""
        if self.process is None or self.process.poll() is not None:
            return []
        with contextlib.suppress(psutil.Error):
            found = psutil.Process(self.process.pid).children(recursive=True)
            return [child for child in found if not names or any(name in " ".join(_words(child)) for name in names)]
        return []

    def kill(self, what: str) -> None:
        """Send SIGKILL, and wait until the processes are gone; the server's own if the wanted one does not run."""
        assert self.process is not None
        hit = []
        if what == "a job's process":
            hit = self.workers("worker", "ingest", "sample")
        elif what == "the live segmenter":
            hit = self.workers("live")
        elif what == "server and workers":
            hit = self.workers()
        if not hit:
            what = "server"
        self.hits[what] += 1
        kill_all(hit)
        if what.startswith("server"):
            self.process.kill()
            self.process.wait()

    def digests(self, project: str, stage: str) -> dict[str, str]:
        """The stored outputs of a stage: the digest of each noun."""
        found = {}
        for path in sorted((self.data / "projects" / project / "work" / "nouns" / stage).glob("*.noun")):
            with contextlib.suppress(FileNotFoundError):
                found[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
        return found

    @contextlib.contextmanager
    def writing(self, project: str) -> Iterator[Path]:
        """The project's folder, for writing results that a job would have made."""
        yield self.data / "projects" / project

    def twice(self) -> list[str]:
        """Work that was done twice, as far as that can be detected."""
        return []

    def stop(self) -> None:
        """Stop the server."""
        if self.process is not None:
            self.process.terminate()
            self.process.wait()

    def _answers(self) -> bool:
        with contextlib.suppress(httpx.HTTPError):
            return httpx.get(f"{self.address}/api/health").status_code == 200
        return False


def kill_all(processes: list[psutil.Process]) -> None:
    """Send SIGKILL to each process that still exists."""
    for process in processes:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process.pid, signal.SIGKILL)


def _words(process: psutil.Process) -> list[str]:
    try:
        return [Path(word).name for word in process.cmdline()]
    except psutil.Error:
        return []
