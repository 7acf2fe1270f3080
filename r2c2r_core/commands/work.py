"""`r2c2r work`."""

import argparse

from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module, whole


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "work", work)
    add_data(added)
    added.add_argument("--live", action="store_true", help="also compute live masks of clicks for servers")
    added.add_argument("--jobs", type=whole(0, 64), default=1, help="heavy jobs at a time (default: %(default)s)")
    added.add_argument(
        "--workers", type=whole(0, 64), default=0, help="parallel objects of a job; 0: as many as cores and memory allow"
    )


def work(options: argparse.Namespace) -> int:
    """Run jobs from the database shared with a server (R2C2R_DATABASE), without serving the app."""
    web_module("work").work(data_dir=options.data, heavy_jobs=options.jobs, workers=options.workers, live=options.live)
    return 0
