"""Mask accuracy against outlines drawn by eye on a real kitchen, from one click per object.

    python benchmarks/segment_outlines.py RECORDING [--outlines FILE] [--workdir DIR] [--overlays DIR] [--keep] [--update]

RECORDING is the 7-Scenes RedKitchen seq-01 folder; FILE lists polygons by object and frame (tests/data/). --overlays draws
every outline (green) and mask (red); --update writes the key "outlines" of benchmarks/segment.json.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from segment_masks import RESULTS, ingested, outlined

from r2c2r_core.arrays import Mask
from r2c2r_core.errors import R2C2RError
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.segment.protocol import SegmentSession
from r2c2r_core.segment.stage import open_session
from r2c2r_core.workspace import Workspace

OUTLINES = Path(__file__).resolve().parents[1] / "tests/data/redkitchen-outlines.json"


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print, and save the figures."""
    options = _parser().parse_args(arguments)
    objects = json.loads(options.outlines.read_text(encoding="utf-8"))["objects"]
    work = Workspace(options.workdir)
    session = open_session(ingested(options.recording, work, keep=options.keep), work.cache)
    means = {entry["name"]: measure(entry, session, options.overlays) for entry in objects}
    overall = float(np.mean(list(means.values())))
    print(f"mean {overall:.3f} over {len(means)} objects (bar 0.85)")
    if options.update:
        document = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
        figures = {"mean": round(overall, 4)} | {name: round(mean, 4) for name, mean in means.items()}
        RESULTS.write_text(json.dumps(document | {"outlines": figures}, indent=1) + "\n", encoding="utf-8")
    return 0


def measure(entry: dict[str, Any], session: SegmentSession, overlays: Path | None) -> float:
    """Mean IoU of one object over its drawn frames."""
    frame, x, y = entry["click"]
    click = PromptPoint(frame=frame, x=float(x), y=float(y), label=1)
    prompt = ObjectPrompt(name=entry["name"], category=entry["category"], points=(click,))
    overlaps = {}
    for number, polygons in entry["frames"].items():
        truth = drawn(polygons, (480, 640))
        try:
            mask = session.mask_at(prompt, int(number))
        except R2C2RError as error:
            print(f"  {error}", file=sys.stderr)
            mask = np.zeros_like(truth)
        overlaps[number] = mask_iou(truth, mask)
        if overlays is not None:
            overlays.mkdir(parents=True, exist_ok=True)
            rgb = session.scene.rgb(int(number))  # type: ignore[attr-defined]  # the geometric session has it
            cv2.imwrite(str(overlays / f"{entry['name']}-{number}-{overlaps[number]:.2f}.png"), outlined(rgb, truth, mask))
    mean = float(np.mean(list(overlaps.values())))
    print(f"  {entry['name']:12} {mean:.3f}   " + "  ".join(f"{n}: {iou:.2f}" for n, iou in overlaps.items()), flush=True)
    return mean


def drawn(polygons: dict[str, Any], shape: tuple[int, int]) -> Mask:
    """The mask of the `on` polygons minus the `off` polygons."""
    canvas = np.zeros(shape, np.uint8)
    for value, key in ((1, "on"), (0, "off")):
        for polygon in polygons.get(key, []):
            cv2.fillPoly(canvas, [np.array(polygon, np.int32)], value)
    return canvas > 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Masks against outlines drawn by eye.")
    parser.add_argument("recording", type=Path)
    parser.add_argument("--outlines", type=Path, default=OUTLINES)
    parser.add_argument("--workdir", type=Path, required=True, help="keeps the capture between runs")
    parser.add_argument("--overlays", type=Path)
    parser.add_argument("--keep", action="store_true", help="use the capture in the workdir whatever version made it")
    parser.add_argument("--update", action="store_true")
    return parser


if __name__ == "__main__":
    sys.exit(main())
