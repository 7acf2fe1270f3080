"""Wall time, CPU time and peak memory of a command, including its children."""

import os
import subprocess
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

_INTERVAL_S = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """Cost of one command."""

    exit_code: int
    wall_s: float
    cpu_s: float  # user and system, of the process and all its children
    peak_bytes: int  # of the whole tree, sampled five times a second; a page that processes share counts once (PSS)
    largest_bytes: int  # of its largest process, at that process's peak


def run_measured(command: Sequence[str], *, cwd: Path, log: Path) -> Cost:
    """Run the command to its end; its output goes to `log`."""
    started = time.monotonic()
    with log.open("wb") as output:
        process = subprocess.Popen(command, cwd=cwd, stdout=output, stderr=subprocess.STDOUT)
        watch = _Watch(psutil.Process(process.pid))
        watch.start()
        _, status, usage = os.wait4(process.pid, 0)  # includes the usage of its children
        process.returncode = os.waitstatus_to_exitcode(status)
        watch.stop()
    return Cost(
        exit_code=process.returncode,
        wall_s=time.monotonic() - started,
        cpu_s=usage.ru_utime + usage.ru_stime,
        peak_bytes=watch.peak_bytes,
        largest_bytes=usage.ru_maxrss * 1024,
    )


class _Watch(threading.Thread):
    """Sampler of a process tree's memory, until stopped."""

    def __init__(self, root: psutil.Process) -> None:
        super().__init__(daemon=True)
        self._root = root
        self._ended = threading.Event()
        self.peak_bytes = 0

    def run(self) -> None:
        """Sample until stopped."""
        while not self._ended.wait(_INTERVAL_S):
            self._sample()

    def stop(self) -> None:
        """Stop sampling."""
        self._ended.set()
        self.join()

    def _sample(self) -> None:
        total = 0
        try:
            tree = [self._root, *self._root.children(recursive=True)]
        except psutil.NoSuchProcess:
            return
        for process in tree:
            try:
                total += process.memory_full_info().pss
            except (psutil.NoSuchProcess, psutil.AccessDenied):  # it has ended, or is about to
                continue
        self.peak_bytes = max(self.peak_bytes, total)
