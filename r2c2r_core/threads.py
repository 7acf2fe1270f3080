"""The same work on many items, on all cores of this process: numpy, OpenCV and whoever waits leave the interpreter free."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from os import cpu_count
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


_AHEAD = 2  # results a thread that wait for the caller, at most: each may be megabytes


def in_threads(work: Callable[[A], B], items: Iterable[A]) -> Iterator[B]:
    """The results in order; what is not begun is dropped when the caller stops asking.

    Tuned numbers hold in the threads as they do here.
    """
    context = copy_context()
    threads = min(4, cpu_count() or 1)
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
