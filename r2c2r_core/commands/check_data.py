"""`r2c2r check-data`."""

import argparse

from r2c2r_core.commands.options import Parsers, add_command, add_data, add_json, web_module, write_json
from r2c2r_core.terminal import show_progress, table


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "check-data", check_data)
    add_data(added)
    add_json(added)


def check_data(options: argparse.Namespace) -> int:
    """Check that the database is intact and that it and the files agree; also while it is served."""
    with show_progress() as progress:
        found = web_module("data_check").check_data(options.data, progress=progress.for_stage("check-data"))
    if options.json:
        write_json(options.json, {"version": 1, "findings": [finding.to_json() for finding in found]})
    print(table(("what", "where", "detail"), [(f.what, f.where, f.detail) for f in found]) if found else "no problems found")
    return 1 if found else 0
