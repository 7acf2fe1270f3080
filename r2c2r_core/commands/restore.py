"""`r2c2r restore`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.backup import described
from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module
from r2c2r_core.terminal import show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "restore", restore)
    added.add_argument("source", type=Path, metavar="BACKUP", help="backup written by `r2c2r backup`, or any copy of r2c2r.db")
    add_data(added)


def restore(options: argparse.Namespace) -> int:
    """Restore a backup into a data folder that is not being served; existing files stay, the old database in backups/."""
    with show_progress() as progress:
        moved = web_module("backups").restore(options.source, options.data, progress=progress.for_stage("restore"))
    print(f"{options.data}: restored {described(moved)}")
    return 0
