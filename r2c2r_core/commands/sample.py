"""`r2c2r sample`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, seed, size, whole
from r2c2r_core.terminal import show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "sample", sample)
    added.add_argument("out", type=Path)
    added.add_argument("--seed", type=seed, default=0)
    added.add_argument("--opened", action="store_true", help="a drawer and a door stand open in the later frames")
    add_size(added)


def add_size(parser: argparse.ArgumentParser) -> None:
    """How long and how large the recording is."""
    parser.add_argument("--frames", type=whole(1, 10_000), default=180)
    parser.add_argument("--size", type=size, default=(960, 720), metavar="WxH")


def sample(options: argparse.Namespace) -> int:
    """Write a synthetic kitchen recording with exact truth."""
    write_recording(options.out, seed=options.seed, frames=options.frames, size=options.size, opened=options.opened)
    return 0


def write_recording(out: Path, *, frames: int, size: tuple[int, int], seed: int = 0, opened: bool = False) -> None:
    """The recording, its truth and its prompts; their paths are printed."""
    from r2c2r_core.disk import explained_io
    from r2c2r_core.synthetic.stage import write_sample

    with show_progress() as progress, explained_io(out):
        paths = write_sample(out, seed=seed, frames=frames, size=size, opened=opened, progress=progress.for_stage("sample"))
    print(f"{paths.scan}  {paths.truth}  {paths.prompts}")
