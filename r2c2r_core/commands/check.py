"""`r2c2r check`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, add_json, existing, write_json
from r2c2r_core.terminal import certificate_text, show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "check", check)
    added.add_argument("bundle", type=Path)
    add_json(added)


def check(options: argparse.Namespace) -> int:
    """Lint and simulation certificate of a bundle."""
    from r2c2r_core.export.stage import certificate_to_json, check_bundle

    with show_progress() as progress:
        certificate = check_bundle(existing(options.bundle), progress=progress.for_stage("check"))
    if options.json:
        write_json(options.json, certificate_to_json(certificate))
    print(certificate_text(certificate))
    return 0 if certificate.passed else 1
