"""The `r2c2r` command: reads the arguments, hands over to one of `commands/`, and turns failures into one line.

Exit codes: 0 done, 1 the work failed or a check fell short, 2 wrong usage or unreadable input. Errors are one line on
stderr; a traceback only with --debug. Results go to stdout, progress to stderr.
"""

import argparse
import os
import sys
import traceback
from collections.abc import Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: on small matrices its threads double the CPU bill

from r2c2r_core import __version__
from r2c2r_core.commands import check, dataset, demo, doctor, evaluate, info, run, sample, serve, user
from r2c2r_core.errors import R2C2RError

COMMANDS = (serve, demo, user, sample, info, run, check, evaluate, dataset, doctor)


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse, run one command, and turn failures into one line and an exit code."""
    options = _parser().parse_args(arguments)
    try:
        return int(options.command(options))
    except R2C2RError as error:
        if options.debug:
            traceback.print_exc()
        print(f"r2c2r: {' '.join(str(error).split())}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("r2c2r: stopped; finished stages are kept, the same command goes on", file=sys.stderr)
        return 1
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader of our output left; say no more
        return 1
    except OSError as error:
        if options.debug:
            traceback.print_exc()
        where = error.filename or "input/output"
        print(f"r2c2r: {where}: {error.strerror or error}; free some space or choose another folder", file=sys.stderr)
        return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="r2c2r", description="One RGB-D scan of a kitchen in, a scene that opens out.")
    parser.add_argument("--version", action="version", version=f"r2c2r {__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    parsers = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.add(parsers)
    return parser


if __name__ == "__main__":
    sys.exit(main())
