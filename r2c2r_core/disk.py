"""Disk errors as one-line messages, path checks, and file permissions."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from r2c2r_core.errors import EnvironmentProblem, InputError

_SHOWN = 200  # maximum characters of an invalid path in a message
DATA_FOLDER = os.environ.get("R2C2R_DATA") or "~/.local/share/r2c2r"
"""The data folder where none is given; the home folder is looked up only where it is used."""

_FULL = (errno.ENOSPC, errno.EDQUOT)


@contextmanager
def explained_io(path: Path) -> Iterator[None]:
    """Context that turns a full disk or a forbidden folder into EnvironmentProblem: one line with the next step."""
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            hint = "free some space and run the same command again: finished stages are kept"
            raise EnvironmentProblem(f"{path}: the disk is full", hint=hint) from error
        where = error.filename or path
        raise EnvironmentProblem(f"{where}: {error.strerror or error}", hint="choose a folder that you may write to") from error


def resolved(path: Path) -> Path:
    """The absolute path with links resolved; raises InputError on impossible paths: cyclic links, a NUL, too long a name."""
    try:
        found = path.expanduser().resolve()
        os.lstat(found)
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{str(path)[:_SHOWN]!r}: not a valid path ({error})", hint="check the path") from error
    except OSError as error:
        if error.errno in (errno.ENAMETOOLONG, errno.ELOOP):
            raise InputError(f"{str(path)[:_SHOWN]!r}: {error.strerror}", hint="check the path") from error
    return found


def data_folder(text: str) -> Path:
    """The data folder of that name; raises EnvironmentProblem where it is below a home folder that this user lacks."""
    try:
        return Path(text).expanduser()
    except RuntimeError as error:
        raise EnvironmentProblem(f"{text}: this user has no home folder", hint="set HOME or R2C2R_DATA") from error


def is_below(path: Path, folder: Path) -> bool:
    """Whether a path with links resolved stays in the folder; False for unresolvable paths."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):  # RuntimeError: cyclic links, before Python 3.13
        return False


def keep_private(folder: Path, marker: str) -> None:
    """Restrict the folder, and all files that this process and its workers write from now on, to their owner.

    An existing folder is restricted only if it is empty or contains `marker`, as any other may also serve other purposes.
    Raises EnvironmentProblem where the folder cannot be created.
    """
    os.umask(0o077)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        names = {path.name for path in folder.iterdir()}
        if names and marker not in names:
            return
        for path in (folder, *folder.glob(f"{marker}*")):
            with suppress(PermissionError):  # another user's: `r2c2r doctor` reports it
                path.chmod(path.stat().st_mode & 0o700)
    except OSError as error:
        raise EnvironmentProblem(f"{folder}: {error.strerror}", hint="choose another folder with --data") from error


def open_to_others(path: Path) -> str | None:
    """The mode of a file or folder in chmod's notation if other users have access; None if they have none."""
    mode = path.stat().st_mode & 0o777
    return f"{mode:o}" if mode & 0o077 else None
