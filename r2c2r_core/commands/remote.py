"""`r2c2r remote`: use of a remote server with an API token."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from r2c2r_core.commands.options import Parsers, add_command, existing, seed, whole
from r2c2r_core.errors import InputError
from r2c2r_core.terminal import show_progress, table

if TYPE_CHECKING:
    from r2c2r_core.client import Server

_SEAMS = ("segmenter", "generator", "matcher")


def add(parsers: Parsers) -> None:
    """The command and what it can do."""
    actions = add_command(parsers, "remote", remote).add_subparsers(required=True, dest="what", metavar="|".join(_ACTIONS))
    added = {what: actions.add_parser(what, help=act.__doc__, description=act.__doc__) for what, act in _ACTIONS.items()}
    for action in added.values():
        action.add_argument(
            "--server",
            default=os.environ.get("R2C2R_SERVER"),
            metavar="ADDRESS",
            help="address of the server (default: the environment variable R2C2R_SERVER)",
        )
    added["upload"].add_argument("capture", type=Path, help="recording: a file, a folder or a zip")
    added["upload"].add_argument("--name", help="name of the project (default: the file's)")
    for what in ("click", "run", "wait", "download", "export"):
        added[what].add_argument("project", help="id of the project, as printed by upload and list")
    added["click"].add_argument("prompts", type=Path, metavar="PROMPTS.json", help="clicks, names and categories of objects")
    for seam in _SEAMS:
        added["run"].add_argument(f"--{seam}", help=f"{seam} backend of the server")
    added["run"].add_argument("--seed", type=seed, default=0, help="random seed of generators (default: %(default)s)")
    added["download"].add_argument("-o", "--output", type=Path, required=True, metavar="BUNDLE.zip", help="file to write")
    added["export"].add_argument("-o", "--output", type=Path, required=True, metavar="PROJECT.zip", help="file to write")
    added["export"].add_argument("--recording", action="store_true", help="include the recording")
    added["download"].add_argument("--version", type=whole(1, 2**31 - 1), help="version of the bundle (default: the newest)")


def remote(options: argparse.Namespace) -> int:
    """Use a server on another machine with the token in R2C2R_TOKEN: list, upload, click, run, wait, download, export."""
    from r2c2r_core.client import Server

    token = os.environ.get("R2C2R_TOKEN", "")
    if not options.server:
        raise InputError("no server given", hint="use --server https://kitchens.example, or set R2C2R_SERVER")
    if not token:  # an argument would be visible to all users of the machine
        raise InputError("R2C2R_TOKEN is not set", hint="create a token on the server's machine: r2c2r token add NAME")
    _ACTIONS[options.what](Server(options.server, token), options)
    return 0


def _list(server: "Server", options: argparse.Namespace) -> None:
    """List the projects you may see."""
    rows = [(each["id"], each["name"], each["status"], each["review_state"]) for each in server.projects()]
    print(table(("project", "name", "status", "review"), rows))


def _upload(server: "Server", options: argparse.Namespace) -> None:
    """Upload a recording or an exported project and print the project's id; an interrupted upload is resumed."""
    with show_progress() as progress:
        print(server.upload(existing(options.capture), options.name, progress))


def _click(server: "Server", options: argparse.Namespace) -> None:
    """Add the objects of a prompts.json."""
    from r2c2r_core.documents import read_json

    prompts = read_json(options.prompts, hint="see docs/schemas/prompts.json")
    if not isinstance(prompts, dict):
        raise InputError(f"{options.prompts}: expected a JSON object", hint="see docs/schemas/prompts.json")
    for item in server.click(options.project, prompts):
        print(f"{item['name']}: {item['category']}")


def _run(server: "Server", options: argparse.Namespace) -> None:
    """Start a run and print the number of its job."""
    tools = {seam: getattr(options, seam) for seam in _SEAMS if getattr(options, seam) is not None}
    print(server.run(options.project, seed=options.seed, **tools))


def _wait(server: "Server", options: argparse.Namespace) -> None:
    """Wait for the project's newest job; exit 1 with the reason if it fails."""
    with show_progress() as progress:
        server.wait(options.project, progress)


def _download(server: "Server", options: argparse.Namespace) -> None:
    """Download the newest bundle, or another version of it."""
    with show_progress() as progress:
        version = server.download(options.project, options.output, options.version, progress)
    print(f"{options.output}: version {version}")


def _export(server: "Server", options: argparse.Namespace) -> None:
    """Download a project as one file, which can be uploaded to another server."""
    with show_progress() as progress:
        server.export(options.project, options.output, recording=options.recording, progress=progress)
    print(options.output)


_ACTIONS = {
    "list": _list,
    "upload": _upload,
    "click": _click,
    "run": _run,
    "wait": _wait,
    "download": _download,
    "export": _export,
}
