"""`r2c2r vary`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, existing, seed, whole
from r2c2r_core.terminal import show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "vary", vary)
    added.add_argument("bundle", type=Path, help="bundle, zipped or as a folder")
    added.add_argument("-n", type=whole(1, 100_000), default=100, metavar="N", help="number of variants (default: %(default)s)")
    added.add_argument(
        "--seed", type=seed, default=0, help="random seed; equal seeds give equal variants (default: %(default)s)"
    )
    added.add_argument("-o", type=Path, required=True, metavar="DIR", help="folder to write; it must not exist")


def vary(options: argparse.Namespace) -> int:
    """Make certified variants of a bundle for training: other sizes, masses, frictions, surfaces, positions, doors ajar."""
    from r2c2r_core.variants.stage import make_variants

    with show_progress() as progress:
        made = make_variants(existing(options.bundle), options.n, options.seed, options.o, progress=progress.for_stage("vary"))
    rejected = ", ".join(f"{count} ({why})" for why, count in made.rejected.items())
    failed = [name for name, passed in made.certified.items() if not passed]
    looked_at = len(made.certified)
    print(f"{len(made.names)} variants in {made.folder}, rejected draws: {rejected or 'none'}")
    print(f"certificates of {looked_at} random variants: {looked_at - len(failed)} passed {' '.join(failed)}".rstrip())
    return 1 if failed else 0
