"""How long tests wait: one patience for every limit, stretched by R2C2R_PATIENCE on a slow machine."""

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
LOOK_S = 0.02  # between two looks at a condition, at least
LONGEST_S = 0.5  # and at most
REST = 3  # times as long as a look took: what is waited for needs the processor more than who waits


def until(condition: Callable[[], object], said: str = "what was waited for did not happen") -> None:
    """Wait until the condition holds; fails after `PATIENCE_S`."""
    began = time.monotonic()
    deadline = began + PATIENCE_S
    while not condition():
        looked = time.monotonic()
        assert looked < deadline, said
        time.sleep(min(max(LOOK_S, REST * (looked - began)), LONGEST_S))
        began = time.monotonic()


def gone(process: psutil.Process) -> bool:
    """Whether a process has ended, be it unknown to its parent yet; it may end between two questions."""
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


@contextmanager
def held() -> Iterator[threading.Event]:
    """An event that what is held waits for; set at the latest when the block ends, so that no thread outlives its test."""
    released = threading.Event()
    try:
        yield released
    finally:
        released.set()
