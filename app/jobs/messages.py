"""Reports of a job's child process: JSON lines on stdout, as in r2c2r_core.worker."""

import json
import signal
import sys
import traceback
from collections.abc import Callable

from app.errors import told
from r2c2r_core.errors import Cancelled, R2C2RError
from r2c2r_core.limits import memory_met
from r2c2r_core.progress import Progress


def run_stage(stage: str, work: Callable[[Progress], None]) -> int:
    """Do the work, report progress, turn a failure into one line, and return the exit status."""
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    report = Progress(
        lambda name, fraction, text: say(stage=name, fraction=round(fraction, 4), text=text), lambda: bool(stopped), stage
    )
    try:
        work(report)
    except R2C2RError as error:
        say(error=told(error))
        return 130 if isinstance(error, Cancelled) else error.exit_code
    except MemoryError:
        traceback.print_exc()
        say(error=told(memory_met()))
        return 1
    except Exception as error:  # the edge of a job: the traceback goes to the log, one line to the user
        traceback.print_exc()
        say(error={"kind": "internal", "message": f"unexpected: {error}", "hint": "see the job's log"})
        return 1
    say(done=stage)
    return 0


def say(**message: object) -> None:
    """Send one line to the server."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()
