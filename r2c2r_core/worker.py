"""One stage in a process of its own: `python -m r2c2r_core.worker WORKDIR --until STAGE [--request FILE] [--only NAME ...]`.

Reads the request (WORKDIR/request.json unless another is named) and prints JSON lines: {"stage", "fraction", "text"} while
working, then either {"done", "computed", "failures", "passed"} or {"error": {"kind", "message", "hint"}}. A stage's memory
returns with its process, and killing it loses at most the noun being computed. With --only it computes these objects of the
stage alone, and with no name after it none: then it makes what they share, and "left" says which are to be computed.
"""

import argparse
import json
import os
import signal
import sys
import traceback
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: on small matrices its threads double the CPU time

from r2c2r_core.config import config_from
from r2c2r_core.disk import resolved
from r2c2r_core.documents import read_json
from r2c2r_core.errors import Cancelled, EnvironmentProblem, InputError, R2C2RError
from r2c2r_core.ledger import STAGES
from r2c2r_core.limits import limit_this_process, memory_met
from r2c2r_core.overrides import NO_OVERRIDES, read_overrides
from r2c2r_core.pipeline import Request, Tools, reconstruct
from r2c2r_core.progress import Progress
from r2c2r_core.schema.document import checked
from r2c2r_core.schema.request import RequestFile
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.workspace import Workspace


def main(arguments: list[str] | None = None) -> int:
    """Run the pipeline up to one stage; 0 done, 1 failed, 2 bad input."""
    parser = argparse.ArgumentParser(prog="r2c2r_core.worker", description=__doc__)
    parser.add_argument("workdir", type=Path)
    parser.add_argument("--until", choices=STAGES, default="export")
    parser.add_argument("--request", type=Path, help="file of the request (default: WORKDIR/request.json)")
    parser.add_argument("--workers", type=int, default=0, help="parallel processes; 0: as many as cores and memory allow")
    parser.add_argument("--only", nargs="*", metavar="NAME", help="compute only these objects of the stage")
    options = parser.parse_args(arguments)
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    progress = Progress(
        lambda stage, fraction, text: _say(stage=stage, fraction=round(fraction, 4), text=text), lambda: bool(stopped)
    )
    try:
        work = Workspace(options.workdir)
        request = read_request(options.request or options.workdir / "request.json")
        outcome = reconstruct(request, work, until=options.until, only=options.only, workers=options.workers, progress=progress)
    except R2C2RError as error:
        _say(error={"kind": type(error).__name__, "message": error.message, "hint": error.hint})
        return 130 if isinstance(error, Cancelled) else error.exit_code
    except (MemoryError, OSError) as error:
        traceback.print_exc(file=sys.stderr)
        met = memory_met() if isinstance(error, MemoryError) else _system_said(error)
        _say(error={"kind": type(met).__name__, "message": met.message, "hint": met.hint})
        return met.exit_code
    except Exception as error:  # the edge of a job: the traceback goes to the log, one line to the user
        traceback.print_exc(file=sys.stderr)
        _say(error={"kind": type(error).__name__, "message": f"unexpected: {error}", "hint": "see the job's log"})
        return 1
    passed = None if outcome.certificate is None else outcome.certificate.passed
    left = {} if options.only is None else {"left": list(outcome.left)}
    _say(done=options.until, computed=list(outcome.computed), failures=outcome.failures, passed=passed, **left)
    return 0


def _system_said(error: OSError) -> EnvironmentProblem:
    return EnvironmentProblem(f"{error.filename or 'a file'}: {error.strerror or error}", hint="see the job's log")


def read_request(path: Path) -> Request:
    """The request read from a file; source, prompts and overrides may be relative to its folder."""
    hint = 'expected {"source": …, "prompts": …}'
    request = checked(RequestFile, read_json(path, hint=hint), str(path), InputError, hint=hint)
    overrides = path.parent / request.overrides
    return Request(
        source=resolved(path.parent / request.source),
        prompts=read_prompts(path.parent / request.prompts),
        overrides=read_overrides(overrides) if overrides.exists() else NO_OVERRIDES,
        config=config_from(request.config, str(path)),
        tools=Tools(**request.tools.model_dump(exclude_none=True)),
        seed=request.seed,
    )


def _say(**message: object) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    limit_this_process()
    sys.exit(main())
