"""The same work on many items, on all cores of this process: numpy, OpenCV and whoever waits leave the interpreter free."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from os import cpu_count
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def in_threads(work: Callable[[A], B], items: Iterable[A]) -> Iterator[B]:
    """The results in order; what is not begun is dropped when the caller stops asking.

    Tuned numbers hold in the threads as they do here.
    """
    context = copy_context()
    pool = ThreadPoolExecutor(min(4, cpu_count() or 1))
    try:
        yield from pool.map(lambda item: context.copy().run(work, item), items)
    finally:
        pool.shutdown(cancel_futures=True)
