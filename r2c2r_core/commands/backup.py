"""`r2c2r backup`."""

import argparse
from pathlib import Path
from typing import Any

from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module
from r2c2r_core.terminal import show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "backup", backup)
    add_data(added)
    wanted = "a new FILE.db for the database alone, or a new folder for the database and the projects' files"
    added.add_argument("-o", dest="target", type=Path, required=True, metavar="OUT", help=wanted)


def backup(options: argparse.Namespace) -> int:
    """Back up the data folder, also while it is served."""
    with show_progress() as progress:
        moved = web_module("backups").backup(options.data, options.target, progress=progress.for_stage("backup"))
    print(f"{options.target}: {described(moved)}; the database is intact")
    return 0


def described(moved: Any) -> str:
    """Text with the sizes of a backup."""
    files = f"{moved.files} files of {moved.projects} projects, {moved.files_bytes / 1e6:.1f} MB"
    return f"database {moved.database_bytes / 1e6:.1f} MB, {files}"
