"""How a child process of a job reports: JSON lines on stdout, as r2c2r_core.worker does."""

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
    """Do the work, report it, and turn its failure into one line; the exit status."""
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
    except Exception as error:  # the edge of a job: the traceback goes to the log, one line to the person
        traceback.print_exc()
        say(error={"kind": "internal", "message": f"unexpected: {error}", "hint": "see the job's log"})
        return 1
    say(done=stage)
    return 0


def say(**message: object) -> None:
    """One line to the server."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()
