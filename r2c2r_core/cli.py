"""The `r2c2r` command: parses arguments, calls one of `commands/`, and prints failures as one line.

Exit codes: 0 done, 1 the work failed or a check fell short, 2 wrong usage or unreadable input, 143 ended by SIGTERM.
Errors are one line on stderr; a traceback only with --debug. Results go to stdout, progress to stderr.
"""

import argparse
import errno
import io
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: on small matrices its threads double the CPU time

from r2c2r_core import __version__
from r2c2r_core.errors import R2C2RError
from r2c2r_core.texts import shown

STOPPED = "r2c2r: stopped; finished stages are kept, run the same command to continue"


class Terminated(BaseException):
    """SIGTERM was received; unwinding closes open resources and removes temporary files."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse arguments, run one command, and turn failures into one line and an exit code."""
    if isinstance(sys.stdout, io.TextIOWrapper):  # a file's name need not be valid text, and is shown anyway
        sys.stdout.reconfigure(errors="backslashreplace")
    options = argparse.Namespace(debug=False)
    try:
        with _ended_by_sigterm():
            options = build_parser().parse_args(arguments)
            return int(options.command(options))
    except R2C2RError as error:
        if options.debug:
            traceback.print_exc()
        print(f"r2c2r: {shown(' '.join(str(error).split()))}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print(STOPPED, file=sys.stderr)
        return 1
    except Terminated:
        print(STOPPED, file=sys.stderr)
        return 128 + signal.SIGTERM
    except BrokenPipeError:
        os.dup2(
            os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno()
        )  # the reader of our output has closed the pipe: write no more
        return 1
    except OSError as error:
        if options.debug:
            traceback.print_exc()
        where = error.filename or "input/output"
        print(f"r2c2r: {shown(str(where))}: {error.strerror or error}; {_way_out(error.errno)}", file=sys.stderr)
        return 1
    except MemoryError as error:
        if options.debug:
            traceback.print_exc()
        print(
            f"r2c2r: out of memory ({error or 'none left'}); close other programs, or use a shorter recording",
            file=sys.stderr,
        )
        return 1
    except Exception as error:  # the last line of defence: any error gives one line
        if options.debug:
            traceback.print_exc()
        found = shown(" ".join(f"{type(error).__name__}: {error}".split()))[:300]
        print(f"r2c2r: internal error ({found}); run again with --debug and report its output", file=sys.stderr)
        return 1


@contextmanager
def _ended_by_sigterm() -> Iterator[None]:
    """Context in which SIGTERM unwinds the stack like an interrupt; a second one ends the process at once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(*_: object) -> NoReturn:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        raise Terminated

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _commands() -> tuple[Any, ...]:
    """The commands in the order of the help; imported here, so that an interrupt during import also gives one line."""
    from r2c2r_core.commands import (
        backup,
        check,
        check_data,
        dataset,
        db,
        demo,
        doctor,
        evaluate,
        info,
        key,
        remote,
        restore,
        run,
        sample,
        schema,
        serve,
        token,
        user,
        vary,
        work,
    )

    return (
        serve,
        work,
        key,
        demo,
        user,
        token,
        backup,
        restore,
        check_data,
        db,
        sample,
        info,
        run,
        check,
        vary,
        evaluate,
        dataset,
        remote,
        schema,
        doctor,
    )


def _way_out(number: int | None) -> str:
    """Hint for a system error, by its errno."""
    if number == errno.ENAMETOOLONG:
        return "use a shorter name"
    if number in (errno.EACCES, errno.EPERM, errno.EROFS):
        return "choose a file or folder that you have access to"
    return "free some space or choose another folder"


def build_parser() -> argparse.ArgumentParser:
    """The command-line parser, with all installed commands."""
    parser = argparse.ArgumentParser(prog="r2c2r", description="From one RGB-D scan of a kitchen to an articulated scene.")
    parser.add_argument("--version", action="version", version=f"r2c2r {__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    parsers = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in _commands():
        command.add(parsers)
    return parser


if __name__ == "__main__":
    sys.exit(main())
