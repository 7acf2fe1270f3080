"""Isolation of failures of single objects, and their one-line messages."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

import cv2

from r2c2r_core.errors import PromptError, R2C2RError, StageError

_log = logging.getLogger(__name__)

OBJECT_FAILS = (StageError, PromptError, ValueError, ArithmeticError, LookupError, RuntimeError, cv2.error)
"""Errors that concern only one object (LinAlgError is a ValueError, Qhull's a RuntimeError); anything else concerns all: a
programming error, a full disk, a missing backend, cancellation by the user."""


@contextmanager
def apart(stage: str, name: str, failures: dict[str, str]) -> Iterator[None]:
    """Context of one object's computation: its failure is recorded under the object's name and does not propagate."""
    try:
        yield
    except OBJECT_FAILS as error:
        record(stage, name, error, failures)


@contextmanager
def spared(what: str, said: list[str]) -> Iterator[None]:
    """Context of an optional step: its failure is recorded and the computation continues.

    `said` gets one line, "what: why".
    """
    try:
        yield
    except OBJECT_FAILS as error:
        said.append(f"{what}: {_in_words(error)}")
        _log.warning("%s", said[-1], exc_info=None if isinstance(error, R2C2RError) else error)


def record(stage: str, name: str, error: Exception, failures: dict[str, str], where: str = "") -> None:
    """Record one line for the user, and log the traceback of unexpected errors (`where`, from another process)."""
    failures[name] = failure_line(stage, name, error)
    if isinstance(error, R2C2RError):
        _log.warning("%s: %s: %s", stage, name, error)
    else:
        _log.warning("%s: %s: %s%s", stage, name, error, where and f"\n{where}", exc_info=None if where else error)


def failure_line(stage: str, name: str, error: Exception) -> str:
    """The failure as one line for the user."""
    if isinstance(error, R2C2RError):
        return f"{stage}: {error}"
    return f"{stage}: {name}: {_in_words(error)}; see the log, or remove the object"


def _in_words(error: Exception) -> str:
    said = (str(error).strip() or "no message").splitlines()[0]
    return said if isinstance(error, R2C2RError) else f"{type(error).__name__}: {said}"
