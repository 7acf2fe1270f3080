"""Time limits of tests: one patience for all, scaled by R2C2R_PATIENCE on slow machines."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import psutil

FACTOR = float(os.environ.get("R2C2R_PATIENCE", "1"))
PATIENCE_S = 180 * FACTOR
"""Seconds until a test gives up waiting for what should happen: nothing that works comes near it."""
PATIENCE_MS = 1000 * PATIENCE_S
LOOK_S = 0.02  # minimum interval between two checks of a condition
LONGEST_S = 0.5  # maximum interval
REST = 3  # interval as a multiple of the check's duration, to leave the CPU to the code under test


def until(condition: Callable[[], object], said: str = "what was waited for did not happen") -> None:
    """Poll until the condition holds; fails after `PATIENCE_S`."""
    began = time.monotonic()
    deadline = began + PATIENCE_S
    while not condition():
        looked = time.monotonic()
        assert looked < deadline, said
        time.sleep(min(max(LOOK_S, REST * (looked - began)), LONGEST_S))
        began = time.monotonic()


def gone(process: psutil.Process) -> bool:
    """Whether a process has ended, possibly as a zombie; it may end between two checks."""
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


@contextmanager
def held() -> Iterator[threading.Event]:
    """An event that blocked code waits for; set at the latest when the block ends, so that no thread outlives its test."""
    released = threading.Event()
    try:
        yield released
    finally:
        released.set()
