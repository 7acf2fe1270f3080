"""What goes wrong with disks, in one line each."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from r2c2r_core.errors import EnvironmentProblem

_FULL = (errno.ENOSPC, errno.EDQUOT)


@contextmanager
def explained_io(path: Path) -> Iterator[None]:
    """Turn a full disk or a forbidden folder into EnvironmentProblem: one line with the next step."""
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            hint = "free some space and run the same command again: finished stages are kept"
            raise EnvironmentProblem(f"{path}: the disk is full", hint=hint) from error
        where = error.filename or path
        raise EnvironmentProblem(f"{where}: {error.strerror or error}", hint="choose a folder you may write to") from error
