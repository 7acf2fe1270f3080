"""`r2c2r run`."""

import argparse
import math
import shutil
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from r2c2r_core.commands.options import Parsers, add_command, add_reading, add_strict, existing, seed, whole, with_reading
from r2c2r_core.errors import CaptureError, InputError
from r2c2r_core.presets import PRESETS
from r2c2r_core.terminal import show_progress, table, verdict
from r2c2r_core.texts import shown

if TYPE_CHECKING:
    from r2c2r_core.config import ReconstructConfig
    from r2c2r_core.ingest.doctor.doubts import Doubts


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "run", run)
    added.add_argument("capture", type=Path, help="recording: a file, a folder or a zip")
    added.add_argument("--prompts", type=Path, required=True, help="prompts.json: clicks, names and categories of objects")
    added.add_argument("-o", "--output", type=Path, required=True, metavar="BUNDLE.zip", help="bundle to write")
    added.add_argument("--workdir", type=Path, help="folder of stage results (default: beside the bundle)")
    added.add_argument("--overrides", type=Path, help="overrides.json: corrections made by a person")
    presets = "settings to start from: default, fast (a first look) or paper (the paper's own choices)"
    added.add_argument("--preset", choices=PRESETS, default="default", help=presets)
    added.add_argument("--config", type=Path, help="JSON file of settings; `r2c2r schema config` describes it")
    add_reading(added)
    for seam in ("segmenter", "generator", "matcher"):
        added.add_argument(f"--{seam}", help="name of a backend; `r2c2r doctor` lists them")
    added.add_argument("--seed", type=seed, default=0, help="random seed of generators (default: %(default)s)")
    added.add_argument(
        "--workers", type=whole(0, 64), default=0, help="objects computed in parallel; 0: as many as cores and memory allow"
    )
    added.add_argument("--masks", type=Path, metavar="DIR", help="also write masks as DIR/<object>/<frame:06d>.png")
    add_strict(added)


def run(options: argparse.Namespace) -> int:
    """Reconstruct a recording with prompts into a certified bundle, without the app."""
    from r2c2r_core.config import read_config

    settings = read_config(options.config, options.preset)
    passed = write_bundle(
        existing(options.capture),
        options.prompts,
        options.output,
        workdir=options.workdir,
        overrides=options.overrides,
        config=replace(settings, ingest=with_reading(settings.ingest, options)),
        tools=_given(options, "segmenter", "generator", "matcher"),
        seed=options.seed,
        workers=options.workers,
        masks=options.masks,
        strict=options.strict,
    )
    return 0 if passed else 1


def write_bundle(
    capture: Path,
    prompts: Path,
    destination: Path,
    *,
    workdir: Path | None = None,
    overrides: Path | None = None,
    config: "ReconstructConfig | None" = None,
    tools: Mapping[str, str] = MappingProxyType({}),
    seed: int = 0,
    workers: int = 0,
    masks: Path | None = None,
    strict: bool = False,
) -> bool:
    """Reconstruct, print a summary, and copy the bundle to `destination`; returns whether it is certified and complete.

    With `strict` its likeness must have passed too. `tools` are names of backends by seam: segmenter, generator, matcher.
    """
    from r2c2r_core.config import ReconstructConfig
    from r2c2r_core.disk import explained_io
    from r2c2r_core.overrides import NO_OVERRIDES, read_overrides, unused_corrections
    from r2c2r_core.pipeline import Request, Tools, doubts_about, reconstruct, restricted_licences
    from r2c2r_core.segment.prompts import read_prompts
    from r2c2r_core.workspace import Workspace

    if destination.suffix != ".zip":
        raise InputError(f"{destination}: not a .zip", hint="give the bundle a name that ends in .zip, such as -o kitchen.zip")
    request = Request(
        source=capture,
        prompts=read_prompts(prompts),
        overrides=read_overrides(overrides) if overrides else NO_OVERRIDES,
        config=config or ReconstructConfig(),
        tools=Tools(**tools),
        seed=seed,
    )
    for line in (*restricted_licences(request), *unused_corrections(request.overrides, request.prompts)):
        print(shown(f"r2c2r: {line}"), file=sys.stderr)
    work = Workspace(workdir or destination.with_suffix(".work"))
    with show_progress() as progress:
        doubts = doubts_about(request, work, progress=progress)
    if doubts.reasons:
        _warn(capture, doubts)
    with show_progress() as progress:
        outcome = reconstruct(request, work, workers=workers, progress=progress)
    assert outcome.reconstruction is not None
    assert outcome.certificate is not None
    with explained_io(destination):
        destination.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(work.bundle, destination)
    if masks:
        _write_masks(outcome.reconstruction, masks)
    if not outcome.computed:
        print("nothing changed: all stages were reused")
    print(_summary(outcome.reconstruction))
    print(", ".join(f"{stage} {taken:.1f} s" for stage, taken in outcome.seconds.items()))
    for line in outcome.reconstruction.scene.warnings:
        print(shown(f"r2c2r: {line}"), file=sys.stderr)
    for name, reason in outcome.failures.items():
        print(shown(f"r2c2r: {name} is not in the bundle: {reason}"), file=sys.stderr)
    print(shown(f"{destination}: {verdict(outcome.certificate)}"))
    alike = not strict or outcome.certificate.likeness.state == "passed"
    return outcome.certificate.passed and alike and not outcome.failures


def _warn(capture: Path, doubts: "Doubts") -> None:
    """Warn about an unusable recording in one line; raises CaptureError where no result is possible."""
    first, *others = doubts.reasons
    if doubts.hopeless:
        raise CaptureError(f"{capture}: {first}", hint="see `r2c2r info`")
    more = f" (and {len(others)} more: `r2c2r info` lists them)" if others else ""
    print(shown(f"r2c2r: {capture} is unusable: {first}{more}; the run continues"), file=sys.stderr)


def _given(options: argparse.Namespace, *names: str) -> dict[str, str]:
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}


def _write_masks(reconstruction: Any, folder: Path) -> None:
    import cv2
    import numpy as np

    from r2c2r_core.geometry.masks import unpack_mask
    from r2c2r_core.workspace import write_atomically

    for track in reconstruction.tracks:
        for frame_index, packed in track.masks.items():
            png = cv2.imencode(".png", unpack_mask(packed).astype(np.uint8) * 255)[1]
            write_atomically(folder / track.name / f"{frame_index:06d}.png", png.tobytes())


def _summary(reconstruction: Any) -> str:
    """Table of object, category, dimensions, joint, mask frames, placement RMS and warnings."""
    tracks = {track.name: track for track in reconstruction.tracks}
    placements = {placement.object_name: placement for placement in reconstruction.placements}
    rows = []
    for item in reconstruction.scene.objects:
        width, depth, height = (f"{100 * size:.1f}" for size in item.dimensions_m)
        joints = ", ".join(f"{joint.type} {joint.upper:.2f}" for joint in item.joints) or "-"
        placement = placements.get(item.name)
        rms = f"{1000 * placement.rms_m:.1f}" if placement and not math.isnan(placement.rms_m) else "-"
        warnings = "; ".join(item.warnings + (placement.warnings if placement else ()))
        frames = len(tracks[item.name].masks) if item.name in tracks else 0
        rows.append((item.name, item.category, f"{width} x {depth} x {height}", joints, str(frames), rms, warnings))
    return table(("object", "category", "w x d x h cm", "joint", "masks", "rms mm", "warnings"), rows)
