"""`r2c2r doctor`."""

import argparse

from r2c2r_core.commands.options import Parsers, add_command, add_data, add_json, write_json
from r2c2r_core.terminal import table


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "doctor", doctor)
    add_data(added)
    add_json(added)


def doctor(options: argparse.Namespace) -> int:
    """Examine this machine: backends, extras, weights, GPU, ports, free disk."""
    from r2c2r_core.doctor import examine_machine

    findings = examine_machine(options.data)
    if options.json:
        write_json(options.json, {"version": 1, "findings": [f.to_json() for f in findings]})
    print(table(("what", "state", "detail"), [(f.what, f.state, f.detail) for f in findings]))
    return 1 if any(f.state == "problem" for f in findings) else 0
