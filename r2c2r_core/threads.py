"""Parallel map on threads, since numpy, OpenCV and blocking calls release the GIL."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


_AHEAD = 2  # maximum pending results per thread, as each may be megabytes


def in_threads(work: Callable[[A], B], items: Iterable[A]) -> Iterator[B]:
    """The results in order; tasks not yet started are cancelled when the caller stops iterating.

    The threads use the caller's tuned numbers.
    """
    context = copy_context()
    threads = min(4, usable_cores())
    pool = ThreadPoolExecutor(threads)
    waiting: deque[Future[B]] = deque()
    try:
        for item in items:
            waiting.append(pool.submit(context.copy().run, work, item))
            if len(waiting) > _AHEAD * threads:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)


def usable_cores() -> int:
    """Number of CPU cores that this process may use; all of them where no process can be restricted, as on macOS."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
