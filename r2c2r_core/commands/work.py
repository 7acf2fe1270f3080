"""`r2c2r work`."""

import argparse

from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module, whole


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "work", work)
    add_data(added)
    added.add_argument("--live", action="store_true", help="draw masks of clicks too, for the servers that show them")
    added.add_argument("--jobs", type=whole(0, 64), default=1, help="heavy jobs at a time (default: %(default)s)")
    added.add_argument(
        "--workers", type=whole(0, 64), default=0, help="objects of a job side by side; 0: as cores and memory allow"
    )


def work(options: argparse.Namespace) -> int:
    """Take jobs from the database that a server shares (R2C2R_DATABASE), and serve nothing."""
    web_module("work").work(data_dir=options.data, heavy_jobs=options.jobs, workers=options.workers, live=options.live)
    return 0
