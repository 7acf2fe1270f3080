"""Wait for a condition that another process fulfils."""

import os
import time
from collections.abc import Callable

PATIENCE = float(os.environ.get("R2C2R_PATIENCE", "1"))  # factor of every time limit; larger on a slow machine


def until(condition: Callable[[], object], seconds: float) -> None:
    """Poll until the condition is true; raises TimeoutError after `seconds`."""
    seconds *= PATIENCE
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"not within {seconds} s")
        time.sleep(0.05)
