"""Shared parts of the commands: registration, argument types, JSON output."""

import argparse
import gc
import importlib
import json
import re
import stat
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from r2c2r_core.disk import DATA_FOLDER, data_folder
from r2c2r_core.documents import kind_of_file
from r2c2r_core.errors import InputError
from r2c2r_core.workspace import write_atomically

if TYPE_CHECKING:
    from r2c2r_core.ingest.stage import IngestConfig

Command = Callable[[argparse.Namespace], int]
Parsers = Any  # what ArgumentParser.add_subparsers returns: argparse has no public name for it

_LARGEST_FACTOR = 10_000.0
_LEAST_SIDE_PX, _MOST_SIDE_PX = 64, 4096  # of a synthetic recording: a phone's videos are at most 3840 wide


def add_command(parsers: Parsers, name: str, command: Command) -> argparse.ArgumentParser:
    """Add a command with its docstring as help; --debug may come before or after its name."""
    text = (command.__doc__ or "").strip()
    added: argparse.ArgumentParser = parsers.add_parser(name, help=text, description=text)
    added.set_defaults(command=command)
    added.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    return added


def add_data(parser: argparse.ArgumentParser) -> None:
    """Add --data: the data folder of the web app."""
    parser.add_argument(
        "--data", type=data_folder, default=DATA_FOLDER, metavar="DIR", help="data folder (default: %(default)s)"
    )


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add --json: a file for the findings as JSON."""
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the findings as JSON")


def add_strict(parser: argparse.ArgumentParser) -> None:
    """Add --strict: also fail on doubtful likeness to the recording."""
    parser.add_argument("--strict", action="store_true", help="exit 1 also if the likeness is doubtful or failed")


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Add --depth-scale and --register-depth: remedies for faults reported by `r2c2r info`."""
    parser.add_argument(
        "--depth-scale", type=factor, metavar="FACTOR", help="factor on recorded depth, such as 0.1 (`r2c2r info` reports it)"
    )
    parser.add_argument(
        "--register-depth", action="store_true", help="register depth to the colour images by the fit of `r2c2r info`"
    )


def with_reading(config: "IngestConfig", options: argparse.Namespace) -> "IngestConfig":
    """The configuration updated by those options."""
    said: dict[str, Any] = {"register_depth": True} if options.register_depth else {}
    if options.depth_scale is not None:
        said["depth_scale"] = options.depth_scale
    return replace(config, **said)


def factor(text: str) -> float:
    """A positive factor of length."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= _LARGEST_FACTOR:
        raise argparse.ArgumentTypeError(f"{text[:40]}: expected a positive number, such as 0.1")
    return value


def whole(least: int, most: int) -> Callable[[str], int]:
    """Parser of a whole number in the range."""

    def read(text: str) -> int:
        if not re.fullmatch(r"[+-]?\d{1,18}", text) or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"{text[:40]}: expected a whole number from {least} to {most}")
        return int(text)

    return read


seed = whole(0, 2**31 - 1)  # range accepted by all random generators
port = whole(0, 65535)  # 0: any free one


def size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT in pixels."""
    match = re.fullmatch(r"(\d{2,4})[xX](\d{2,4})", text)
    if match is None or min(int(match[1]), int(match[2])) < _LEAST_SIDE_PX or max(int(match[1]), int(match[2])) > _MOST_SIDE_PX:
        expected = f"WIDTHxHEIGHT, such as 960x720, from {_LEAST_SIDE_PX} to {_MOST_SIDE_PX} each"
        raise argparse.ArgumentTypeError(f"{text[:40]}: expected {expected}")
    return int(match[1]), int(match[2])


def existing(path: Path) -> Path:
    """An existing file or folder."""
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError) as error:
        raise InputError(f"{path}: no such file or folder", hint="check the path") from error
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}", hint="check the path") from error
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # reading a pipe would block
        raise InputError(f"{path}: {kind_of_file(mode)}, expected a file or a folder", hint="check the path")
    return path


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Write a JSON document atomically."""
    write_atomically(path, (json.dumps(document, indent=1) + "\n").encode())


def web_module(name: str) -> Any:
    """A module of the web app, by name, as the core never imports it (architecture: never r2c2r_core -> app)."""
    gc.disable()  # imports create no garbage, and looking for it takes a sixth of their time
    try:
        return importlib.import_module(f"app.{name}")
    finally:
        gc.enable()
