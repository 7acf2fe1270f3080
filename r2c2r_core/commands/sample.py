"""`r2c2r sample`."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from r2c2r_core.commands.options import Parsers, add_command, seed, size, whole
from r2c2r_core.synthetic.choices import LAYOUTS, PALETTES, STYLES, Choice
from r2c2r_core.terminal import show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "sample", sample)
    added.add_argument("out", type=Path, help="folder to write: scan.r3d, truth.json, prompts.json")
    added.add_argument(
        "--seed", type=seed, default=0, help="random seed; equal seeds give equal recordings (default: %(default)s)"
    )
    how = added.add_mutually_exclusive_group()
    how.add_argument("--opened", action="store_true", help="open and close fronts while filming")
    how.add_argument(
        "--as-filmed",
        action="store_true",
        help="add the faults of real recordings, from a tilt to unregistered depth; run it with --register-depth",
    )
    add_size(added)
    added.formatter_class = argparse.RawDescriptionHelpFormatter
    added.add_argument("--style", choices=STYLES, metavar="NAME", help="style of the fronts, as listed below")
    added.add_argument("--palette", choices=PALETTES, metavar="NAME", help="colours of the fronts, as listed below")
    added.add_argument("--layout", choices=LAYOUTS, metavar="NAME", help="arrangement of the units, as listed below")
    added.epilog = "\n\n".join(
        (
            _listed("styles", STYLES),
            _listed("palettes", PALETTES),
            _listed("layouts", LAYOUTS),
            "Without a style and a layout the seed also chooses the style: slab fronts, or frames round a sunk panel.",
        )
    )


def _listed(title: str, names: Mapping[str, str]) -> str:
    return "\n".join([f"{title}:", *(f"  {name:<12}{meaning}" for name, meaning in names.items())])


def add_size(parser: argparse.ArgumentParser) -> None:
    """Add options for the length and the image size of the recording."""
    parser.add_argument("--frames", type=whole(1, 10_000), default=180, help="number of frames (default: %(default)s)")
    parser.add_argument("--size", type=size, default=(960, 720), metavar="WxH", help="image size in px (default: 960x720)")


def sample(options: argparse.Namespace) -> int:
    """Write a recording of a synthetic kitchen with exact ground truth."""
    choice = Choice(style=options.style, palette=options.palette, layout=options.layout)
    chosen = {"opened": options.opened, "as_filmed": options.as_filmed, "choice": choice}
    write_recording(options.out, seed=options.seed, frames=options.frames, size=options.size, **chosen)
    return 0


def write_recording(out: Path, **chosen: Any) -> None:
    """Write the recording, its truth and its prompts, as chosen of `write_sample`'s options, and print their paths."""
    from r2c2r_core.disk import explained_io
    from r2c2r_core.synthetic.stage import write_sample

    with show_progress() as progress, explained_io(out):
        paths = write_sample(out, progress=progress.for_stage("sample"), **chosen)
    print(f"{paths.scan}  {paths.truth}  {paths.prompts}")
