"""Wait for what another process does."""

import os
import time
from collections.abc import Callable

PATIENCE = float(os.environ.get("R2C2R_PATIENCE", "1"))  # times every limit: a slow machine's is larger


def until(condition: Callable[[], object], seconds: float) -> None:
    """Wait for it; raises TimeoutError."""
    seconds *= PATIENCE
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"not within {seconds} s")
        time.sleep(0.05)
