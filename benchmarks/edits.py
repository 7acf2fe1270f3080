"""Edge errors of clicked fronts after the cut and after each later edit, against the truth of synthetic kitchens.

    python benchmarks/edits.py KITCHEN… [--clicks 2] [--workdir DIR] [--update NAME]

A KITCHEN is a folder as segment_fronts.py takes it; clicks are random. For each step: the median error of all edges, the share
of edges and of fronts within 5 and 10 mm, and how many edges the step moved by more than 3 mm nearer to the truth and farther
off. A front that is not found counts as wrong. --update writes this group of kitchens into benchmarks/edits.json.
"""

import argparse
import json
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from recordings import recording_in
from segment_fronts import TrueFront, clicks_on, off_mm, opened_recording, true_fronts

from r2c2r_core.errors import R2C2RError
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.mosaics.edges import Surface, panel_edges
from r2c2r_core.segment.mosaics.orthomosaic import Cell

RESULTS = Path(__file__).resolve().parent / "edits.json"
STEPS = ("cut", "panel_edges", "clear_of_strips")
MOVED_MM, CAP_MM = 3.0, 100.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Click every front, trace, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kitchens", type=Path, nargs="+")
    parser.add_argument("--clicks", type=int, default=2)
    parser.add_argument("--workdir", type=Path, default=Path("fronts-work"))
    parser.add_argument("--update", metavar="NAME")
    options = parser.parse_args(arguments)
    traced = [
        errors for kitchen in options.kitchens for errors in trace(kitchen, options.workdir / kitchen.name, options.clicks)
    ]
    figures = {"kitchens": len(options.kitchens), "clicks": len(traced)} | judged(np.array(traced))
    print(json.dumps(figures, indent=1))
    if options.update:
        stored = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
        RESULTS.write_text(json.dumps(stored | {options.update: figures}, indent=1) + "\n", encoding="utf-8")
    return 0


def trace(kitchen: Path, folder: Path, clicks: int) -> Iterator[np.ndarray]:
    """Edge errors in mm (steps, 4) of each click; infinite where no front was found."""
    session, capture = opened_recording(recording_in(kitchen), folder)
    rng, cuts = np.random.default_rng(zlib.crc32(kitchen.name.encode())), list[tuple[Cell, Cell]]()

    def recorded(cell: Cell, surface: Surface, cell_m: float) -> Cell:
        refined = panel_edges(cell, surface, cell_m)
        cuts.append((cell, refined))
        return refined

    with patch("r2c2r_core.segment.fronts.front.panel_edges", recorded):
        for true in true_fronts(kitchen / "truth.json", capture.world_from_capture):
            for click in clicks_on(session.scene, true, clicks, rng):
                found = _found(session, ObjectPrompt(name=true.name, category=true.category, points=(click,)))
                if found is None or not cuts:
                    yield np.full((len(STEPS), 4), np.inf)
                else:
                    yield np.stack([_errors(true, found, cell) for cell in (*cuts[-1], found.cell)])


def _found(session: Any, prompt: ObjectPrompt) -> Front | None:
    try:
        found = session.find(prompt)
    except R2C2RError:
        return None
    return found.front if isinstance(found, FoundFront) else None


def _errors(true: TrueFront, front: Front, cell: Cell) -> np.ndarray:
    return np.abs(off_mm(true, Front(front.run, cell, None, 0.0).rectangle))


def judged(errors: np.ndarray) -> dict[str, Any]:
    """Figures of each step from errors (clicks, steps, 4)."""
    figures = {}
    for k, step in enumerate(STEPS):
        after, worst = errors[:, k], errors[:, k].max(axis=1)
        row: dict[str, Any] = {"median_mm": round(float(np.median(after)), 1)}
        for mm in (5, 10):
            row |= {
                f"edges_{mm}_mm": round(float(np.mean(after <= mm)), 3),
                f"fronts_{mm}_mm": round(float(np.mean(worst <= mm)), 3),
            }
        if k:
            nearer = np.minimum(errors[:, k - 1], CAP_MM) - np.minimum(after, CAP_MM)
            row |= {"better": int((nearer > MOVED_MM).sum()), "worse": int((nearer < -MOVED_MM).sum())}
        figures[step] = row
    return figures


if __name__ == "__main__":
    raise SystemExit(main())
