"""Ray cluster for tests: one node of two CPUs, in a process that stops it.

`python -m tests.app.ray_cluster` is that process: it prints the address, and ends with its stdin.
"""

import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest

from tests.waiting import PATIENCE_S

QUIET = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_worker_niceness": "0"}  # otherwise its workers starve on a busy machine
TOKEN = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": "not-a-secret-of-the-tests-0123456789abcdef"}


class RayNode:
    """A node that others find by RAY_ADDRESS."""

    def __init__(self, environment: dict[str, str]) -> None:
        self._environment = {**os.environ, **environment, **QUIET, **TOKEN}
        self.start()

    def start(self) -> None:
        command, pipe = [sys.executable, "-m", "tests.app.ray_cluster"], subprocess.PIPE
        root = Path(__file__).resolve().parents[2]
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=self._environment, cwd=root)
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        assert self.address, "Ray did not start"

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables that point others to it."""
        return {"RAY_ADDRESS": self.address, **TOKEN}

    def actors(self) -> list[psutil.Process]:
        """Actor processes of job steps."""
        return [process for process in self._all() if any("NodeSeat" in word for word in _words(process))]

    def kill(self) -> None:
        """Kill the node except for the process groups of steps, which have to end by themselves."""
        for process in [psutil.Process(self.process.pid), *self._all()]:
            if "app.tethered" not in _words(process):
                with suppress(psutil.Error):
                    process.kill()
        self.process.wait()

    def stop(self) -> None:
        assert self.process.stdin is not None
        left = self._all()
        self.process.stdin.close()
        assert self.process.stdout is not None
        self.process.stdout.close()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(timeout=PATIENCE_S)
        for process in left:
            with suppress(psutil.Error):
                process.kill()
        self.process.kill()
        self.process.wait()

    def _all(self) -> list[psutil.Process]:
        with suppress(psutil.Error):
            return [child for child in psutil.Process(self.process.pid).children(recursive=True) if _words(child)]
        return []


@contextmanager
def ray_node(**environment: str) -> Iterator[RayNode]:
    """A running node; skips without Ray, as in CI: its wheel is 79 MB, and each step starts processes."""
    if importlib.util.find_spec("ray") is None:
        pytest.skip("no Ray here: pip install 'r2c2r[ray]'")
    found = RayNode(environment)
    try:
        yield found
    finally:
        found.stop()


def _words(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def main() -> None:
    import ray

    with tempfile.TemporaryDirectory(prefix="r2c2r-ray-", ignore_cleanup_errors=True) as folder:
        given = {"num_cpus": 2, "object_store_memory": 80 << 20, "include_dashboard": False, "_temp_dir": folder}
        context = ray.init(**given, log_to_driver=False, logging_level="ERROR")
        sys.stdout.write(f"{context.address_info['gcs_address']}\n")
        sys.stdout.flush()
        sys.stdin.read()
        ray.shutdown()


if __name__ == "__main__":
    main()
