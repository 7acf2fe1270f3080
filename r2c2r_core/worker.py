"""One stage in a process of its own: `python -m r2c2r_core.worker WORKDIR --until STAGE`.

Reads WORKDIR/request.json and prints JSON lines: {"stage", "fraction", "text"} while working, then either
{"done", "computed", "failures", "passed"} or {"error": {"kind", "message", "hint"}}. A stage's memory returns with its
process, and killing it loses at most the noun being computed.
"""

import argparse
import json
import os
import signal
import sys
import traceback
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: on small matrices its threads double the CPU bill

from r2c2r_core.config import ReconstructConfig, config_from
from r2c2r_core.errors import Cancelled, InputError, R2C2RError
from r2c2r_core.ledger import STAGES
from r2c2r_core.overrides import NO_OVERRIDES, read_overrides
from r2c2r_core.pipeline import Request, Tools, reconstruct
from r2c2r_core.progress import Progress
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.workspace import Workspace


def main(arguments: list[str] | None = None) -> int:
    """Run the pipeline up to one stage; 0 done, 1 failed, 2 bad input."""
    parser = argparse.ArgumentParser(prog="r2c2r_core.worker", description=__doc__)
    parser.add_argument("workdir", type=Path)
    parser.add_argument("--until", choices=STAGES, default="export")
    options = parser.parse_args(arguments)
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    progress = Progress(
        lambda stage, fraction, text: _say(stage=stage, fraction=round(fraction, 4), text=text), lambda: bool(stopped)
    )
    try:
        work = Workspace(options.workdir)
        outcome = reconstruct(read_request(options.workdir), work, until=options.until, progress=progress)
    except R2C2RError as error:
        _say(error={"kind": type(error).__name__, "message": error.message, "hint": error.hint})
        return 130 if isinstance(error, Cancelled) else error.exit_code
    except Exception as error:  # the edge of a job: the traceback goes to the log, one line to the person
        traceback.print_exc(file=sys.stderr)
        _say(error={"kind": type(error).__name__, "message": f"unexpected: {error}", "hint": "see the job's log"})
        return 1
    passed = None if outcome.certificate is None else outcome.certificate.passed
    _say(done=options.until, computed=list(outcome.computed), failures=outcome.failures, passed=passed)
    return 0


def read_request(workdir: Path) -> Request:
    """The request a workdir was set up with; source, prompts and overrides may be relative to it."""
    path = workdir / "request.json"
    try:
        document: dict[str, Any] = json.loads(path.read_text())
        source = (workdir / document["source"]).resolve()
        prompts = workdir / document.get("prompts", "prompts.json")
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{path}: not a request ({error})", hint='expected {"source": …, "prompts": …}') from error
    overrides = workdir / document.get("overrides", "overrides.json")
    return Request(
        source=source,
        prompts=read_prompts(prompts),
        overrides=read_overrides(overrides) if overrides.exists() else NO_OVERRIDES,
        config=config_from(document["config"], str(path)) if "config" in document else ReconstructConfig(),
        tools=Tools(**document.get("tools", {})),
        seed=int(document.get("seed", 0)),
    )


def _say_progress(stage: str, fraction: float, text: str) -> None:
    _say(stage=stage, fraction=round(fraction, 4), text=text)


def _say(**message: object) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
