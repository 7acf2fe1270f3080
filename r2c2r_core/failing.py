"""What the computing of one object may end in without ending it for the others, and how that is told."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

import cv2

from r2c2r_core.errors import PromptError, R2C2RError, StageError

_log = logging.getLogger(__name__)

OBJECT_FAILS = (StageError, PromptError, ValueError, ArithmeticError, LookupError, RuntimeError, cv2.error)
"""What one object's measurements may end in (LinAlgError is a ValueError, Qhull's a RuntimeError); anything else is wrong for
all: a programming error, a full disk, a missing backend, a person who cancelled."""


@contextmanager
def apart(stage: str, name: str, failures: dict[str, str]) -> Iterator[None]:
    """What computes one object: what it may end in is recorded by the object's name, and ends nothing else."""
    try:
        yield
    except OBJECT_FAILS as error:
        record(stage, name, error, failures)


@contextmanager
def spared(what: str, said: list[str]) -> Iterator[None]:
    """A step that all go through, at the place of one of them: what it may end in is said there, and the rest goes on.

    `said` gets one line, "what: why".
    """
    try:
        yield
    except OBJECT_FAILS as error:
        said.append(f"{what}: {_in_words(error)}")
        _log.warning("%s", said[-1], exc_info=None if isinstance(error, R2C2RError) else error)


def record(stage: str, name: str, error: Exception, failures: dict[str, str], where: str = "") -> None:
    """One line for a person; the traceback of what nobody foresaw (`where`, from another process) goes to the log."""
    failures[name] = failure_line(stage, name, error)
    if isinstance(error, R2C2RError):
        _log.warning("%s: %s: %s", stage, name, error)
    else:
        _log.warning("%s: %s: %s%s", stage, name, error, where and f"\n{where}", exc_info=None if where else error)


def failure_line(stage: str, name: str, error: Exception) -> str:
    """One line for a person."""
    if isinstance(error, R2C2RError):
        return f"{stage}: {error}"
    return f"{stage}: {name}: {_in_words(error)}; see the log, or leave it out"


def _in_words(error: Exception) -> str:
    said = (str(error).strip() or "no message").splitlines()[0]
    return said if isinstance(error, R2C2RError) else f"{type(error).__name__}: {said}"
