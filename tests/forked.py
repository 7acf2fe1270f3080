"""Servers forked from a process that has already imported the app: each starts in a tenth of the time."""

import multiprocessing
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any

from tests.waiting import PATIENCE_S

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(["tests.preloaded"])


class Forked:
    """A module's function in its own process with the current environment; its output is read line by line."""

    def __init__(self, run: Callable[..., None], *args: Any, **kwargs: Any) -> None:
        reader, writer = _CONTEXT.Pipe(duplex=False)
        self.process = _CONTEXT.Process(target=_run, args=(writer, dict(os.environ), run, args, kwargs))
        self.process.start()
        writer.close()
        self._printed = os.fdopen(os.dup(reader.fileno()))
        reader.close()

    @property
    def pid(self) -> int:
        """Process id."""
        assert self.process.pid is not None
        return self.process.pid

    def readline(self) -> str:
        """The next line of output; empty once the process has ended."""
        return self._printed.readline()

    def kill(self) -> None:
        """Kill the process."""
        self.process.kill()
        self.process.join()
        self._printed.close()

    def end(self) -> int:
        """Terminate the process, or kill it if it does not end; return its exit code."""
        self.process.terminate()
        self.process.join(PATIENCE_S)
        code = self.process.exitcode
        self.kill()
        return -1 if code is None else code


@contextmanager
def forked(run: Callable[..., None], *args: Any, **kwargs: Any) -> Iterator[Forked]:
    """Run a function in its own process, which is terminated when the block ends."""
    process = Forked(run, *args, **kwargs)
    try:
        yield process
    finally:
        process.end()


def _run(writer: Connection, environment: dict[str, str], run: Callable[..., None], args: Any, kwargs: Any) -> None:
    os.dup2(writer.fileno(), 1)
    writer.close()
    os.environ.clear()
    os.environ.update(environment)
    run(*args, **kwargs)
