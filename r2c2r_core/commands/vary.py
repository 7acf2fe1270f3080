"""`r2c2r vary`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, existing, seed, whole
from r2c2r_core.terminal import show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "vary", vary)
    added.add_argument("bundle", type=Path, help="bundle, zipped or as a folder")
    added.add_argument("-n", type=whole(1, 100_000), default=100, metavar="N", help="how many (default: %(default)s)")
    added.add_argument(
        "--seed", type=seed, default=0, help="of the draws; equal seeds give equal variants (default: %(default)s)"
    )
    added.add_argument("-o", type=Path, required=True, metavar="DIR", help="a new folder")


def vary(options: argparse.Namespace) -> int:
    """Certified variants of a bundle for training: sizes, masses, frictions, surfaces, things moved, doors ajar."""
    from r2c2r_core.variants.stage import make_variants

    with show_progress() as progress:
        made = make_variants(existing(options.bundle), options.n, options.seed, options.o, progress=progress.for_stage("vary"))
    rejected = ", ".join(f"{count} ({why})" for why, count in made.rejected.items())
    failed = [name for name, passed in made.certified.items() if not passed]
    looked_at = len(made.certified)
    print(f"{len(made.names)} variants in {made.folder}, draws rejected: {rejected or 'none'}")
    print(f"certificate of {looked_at} at random: {looked_at - len(failed)} passed {' '.join(failed)}".rstrip())
    return 1 if failed else 0
