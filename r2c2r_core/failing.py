"""What the computing of one object may end in without ending it for the others, and how that is told."""

import cv2

from r2c2r_core.errors import PromptError, R2C2RError, StageError

OBJECT_FAILS = (StageError, PromptError, ValueError, ArithmeticError, LookupError, RuntimeError, cv2.error)
"""What one object's measurements may end in (LinAlgError is a ValueError, Qhull's a RuntimeError); anything else is wrong for
all: a programming error, a full disk, a missing backend, a person who cancelled."""


def failure_line(stage: str, name: str, error: Exception) -> str:
    """One line for a person."""
    if isinstance(error, R2C2RError):
        return f"{stage}: {error}"
    said = (str(error).strip() or "no message").splitlines()[0]
    return f"{stage}: {name}: {type(error).__name__}: {said}; see the log, or leave it out"
