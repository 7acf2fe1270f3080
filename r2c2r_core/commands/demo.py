"""`r2c2r demo`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, add_data, web_module
from r2c2r_core.commands.run import write_bundle
from r2c2r_core.commands.sample import add_size, write_recording
from r2c2r_core.commands.serve import add_address

NAME = "Sample kitchen"  # of the project, and of the recording, from which the bundle takes its title


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "demo", demo)
    add_address(added)
    add_data(added)
    added.add_argument("--no-serve", action="store_true", help="stop after the bundle is written")
    add_size(added)


def demo(options: argparse.Namespace) -> int:
    """Render a sample kitchen, reconstruct it into a certified bundle, and open it in the web app."""
    app = web_module("serve")
    app.require_database(options.data)
    folder: Path = options.data / "demo"
    scan, work = folder / "sample" / f"{NAME}.r3d", folder / "work"
    if not scan.exists():
        write_recording(scan.parent, frames=options.frames, size=options.size, name=NAME)
    prompts = scan.with_name("prompts.json")
    passed = write_bundle(scan, prompts, folder / "kitchen.zip", workdir=work)
    if not passed:
        return 1
    project = app.register_finished(options.data, name=NAME, source=scan, prompts=prompts, workdir=work)
    if not options.no_serve:
        app.serve(host=options.host, port=options.port, data_dir=options.data, open_project=project)
    return 0
