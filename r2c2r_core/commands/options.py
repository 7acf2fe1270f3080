"""What the commands share: how one is added, values with a meaning, the JSON file beside what is printed."""

import argparse
import importlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from r2c2r_core.errors import InputError
from r2c2r_core.workspace import write_atomically

Command = Callable[[argparse.Namespace], int]
Parsers = Any  # what ArgumentParser.add_subparsers returns: argparse has no public name for it

DATA = Path(os.environ.get("R2C2R_DATA", Path.home() / ".local" / "share" / "r2c2r"))


def add_command(parsers: Parsers, name: str, command: Command) -> argparse.ArgumentParser:
    """A command whose help is its docstring; --debug may stand before or after its name."""
    text = (command.__doc__ or "").strip()
    added: argparse.ArgumentParser = parsers.add_parser(name, help=text, description=text)
    added.set_defaults(command=command)
    added.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    return added


def add_data(parser: argparse.ArgumentParser) -> None:
    """--data: where the web app keeps its projects."""
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the projects (default: %(default)s)")


def add_json(parser: argparse.ArgumentParser) -> None:
    """--json: the same findings for a program."""
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was found as JSON too")


def positive(text: str) -> int:
    """A whole number from 1 up."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}: expected a positive number")
    return value


def size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT in pixels, each from 64 up."""
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) >= 64 and int(height) >= 64):
        raise argparse.ArgumentTypeError(f"{text}: expected WIDTHxHEIGHT, such as 960x720")
    return int(width), int(height)


def existing(path: Path) -> Path:
    """A path that is there."""
    if not path.exists():
        raise InputError(f"{path}: no such file or folder", hint="check the path")
    return path


def write_json(path: Path, document: dict[str, Any]) -> None:
    """A document for a program, whole or not at all."""
    write_atomically(path, (json.dumps(document, indent=1) + "\n").encode())


def web_module(name: str) -> Any:
    """A module of the web half, by name: the core never imports it (architecture: never r2c2r_core -> app)."""
    return importlib.import_module(f"app.{name}")
