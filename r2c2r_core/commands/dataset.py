"""`r2c2r dataset`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, existing
from r2c2r_core.errors import InputError
from r2c2r_core.terminal import show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "dataset", dataset)
    added.add_argument("workdir", type=Path, help="the --workdir of r2c2r run, or a project's work folder")
    added.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write")


def dataset(options: argparse.Namespace) -> int:
    """Write a finished work folder as a dataset: labelled frames, candidate meshes, matches, aligned meshes (paper §3)."""
    from r2c2r_core.dataset.stage import LabelledObject, StoredFrames, write_dataset
    from r2c2r_core.disk import explained_io
    from r2c2r_core.ingest.store import depth_path, rgb_path
    from r2c2r_core.workspace import Workspace

    workdir = existing(options.workdir)
    if not (workdir / "nouns").is_dir():
        raise InputError(f"{workdir}: not a work folder", hint="give the --workdir of r2c2r run")
    work = Workspace(workdir)
    capture = work.load_latest("ingest", "scene")
    if capture is None:
        raise InputError(f"{workdir}: it holds no recording", hint="first use r2c2r run with this --workdir")
    objects = [
        LabelledObject(track, work.load_latest("generate", name), work.load_latest("align", name))
        for name in work.names("segment")
        if (track := work.load_latest("segment", name)) is not None
    ]
    stored = StoredFrames(lambda index: rgb_path(work.frames, index), lambda index: depth_path(work.frames, index))
    with show_progress() as progress, explained_io(options.output):
        manifest = write_dataset(capture, objects, stored, options.output, progress=progress.for_stage("dataset"))
    placed = sum((options.output / "objects" / item.track.name / "aligned.glb").exists() for item in objects)
    print(f"{manifest}: {len(objects)} objects, {placed} of them placed")
    return 0
