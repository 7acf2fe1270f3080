"""Elevations of a recording as pictures, with the evidence that each front was cut on, for debugging wrong fronts.

    python benchmarks/elevations.py RECORDING [--prompts FILE] [--truth FILE] [--workdir DIR] -o DIR

Each vertical plane of the scan gives DIR/plane_NN.png, the largest plane first, with four pictures one below the other:
the orthomosaic; the same with the cut fronts (green), the fronts found from clicks (orange, by name) and the true ones (white);
the odds of edges (red upright, blue level) and handles (green) that the cut used; and the area with depth.
A table lists each plane's size, what was cut, and which clicks lie on it. Prepared data is kept in --workdir.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from segment_fronts import TrueFront, opened_recording, true_fronts

from r2c2r_core.arrays import Image
from r2c2r_core.errors import R2C2RError
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell, PlaneGrid
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.segment.runs.run import Run

LEAST_SIDE_M = 0.3  # minimum side of a plane that is drawn: about the size of a single front
ON_PLANE_M = 0.03  # maximum distance of a true front's face from the plane that it is drawn on
GREEN, ORANGE, WHITE = (90, 200, 90), (40, 140, 255), (255, 255, 255)  # BGR


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw every plane and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--prompts", type=Path)
    parser.add_argument("--truth", type=Path)
    parser.add_argument("--workdir", type=Path, default=Path("elevations-work"))
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    options = parser.parse_args(arguments)
    session, capture = opened_recording(options.recording, options.workdir)
    prompts = read_prompts(options.prompts).objects if options.prompts else ()
    found = {prompt.name: front for prompt in prompts if (front := front_of(session, prompt)) is not None}
    true = list(true_fronts(options.truth, capture.world_from_capture)) if options.truth else []
    large = [plane for plane in session.planes if min(plane.width_m, plane.height_m) >= LEAST_SIDE_M]
    runs = [run for plane in sorted(large, key=lambda plane: -plane.area_m2) if (run := session.run_of(plane)) is not None]
    options.output.mkdir(parents=True, exist_ok=True)
    for number, run in enumerate(runs):
        mine = {name: front.front.cell for name, front in found.items() if front.front.run.region is run.region}
        faces = [cell for front in true if (cell := face_on(run.grid, front)) is not None]
        cv2.imwrite(str(options.output / f"plane_{number:02d}.png"), drawn(run, mine, faces))
        size = f"{run.region.width_m:.2f} x {run.region.height_m:.2f} m"
        print(f"plane_{number:02d}  {size}  {len(run.cells)} cut, {len(faces)} true  {' '.join(mine)}")
    lost = [prompt.name for prompt in prompts if prompt.name not in found]
    print(f"no front: {' '.join(lost) or '-'}")
    return 0


def front_of(session: Any, prompt: ObjectPrompt) -> FoundFront | None:
    """The front that a prompt's clicks give; otherwise None, with the error printed."""
    try:
        found = session.find(prompt)
    except R2C2RError as error:
        print(f"{prompt.name}: {error}", file=sys.stderr)
        return None
    return found if isinstance(found, FoundFront) else None


def face_on(grid: PlaneGrid, front: TrueFront) -> Cell | None:
    """A true front's face in grid cells; None where it lies on another plane."""
    half = np.array([front.width_m, front.height_m]) / 2
    corners = front.world_from_face.apply(np.array([[-half[0], 0.0, half[1]], [half[0], 0.0, -half[1]]]))
    local = grid.world_from_plane.inverse.apply(corners)
    facing = float(grid.outward @ -front.world_from_face.rotation[:, 1])
    if facing < np.cos(np.deg2rad(10)) or np.abs(local[:, 1]).max() > ON_PLANE_M:
        return None
    (left, top), (right, bottom) = grid.cells_of(corners).tolist()
    inside = 0 < (left + right) / 2 < grid.columns and 0 < (top + bottom) / 2 < grid.rows
    return Cell(left, top, right, bottom) if inside else None


def drawn(run: Run, found: dict[str, Cell], true: Sequence[Cell]) -> Image:
    """The four pictures of a plane."""
    plain = np.ascontiguousarray(run.mosaic[..., ::-1])
    cut = plain.copy()
    for cell in true:
        outline(cut, cell, WHITE, 3)
    for cell in run.cells:
        outline(cut, cell, GREEN, 2)
    for name, cell in found.items():
        outline(cut, cell, ORANGE, 1)
        at = (round(cell.left) + 4, round(cell.top) + 16)
        cv2.putText(cut, name, at, cv2.FONT_HERSHEY_SIMPLEX, 0.45, ORANGE, 1, cv2.LINE_AA)
    odds = np.stack([run.odds.level, run.odds.handle, run.odds.upright], axis=-1)  # BGR
    shares = np.round(255 / (1 + np.exp(-odds))).astype(np.uint8)
    shares = cv2.resize(shares, None, fx=STEP, fy=STEP, interpolation=cv2.INTER_NEAREST)
    depth = np.repeat(255 * run.seen.astype(np.uint8)[..., None], 3, axis=2)
    size = (run.grid.columns, run.grid.rows)
    return np.concatenate([fitted(picture, size) for picture in (plain, cut, shares, depth)])


def fitted(picture: Image, size: tuple[int, int]) -> Image:
    """The picture cut or padded to a plane's grid, with a line below it."""
    out = np.zeros((size[1] + 2, size[0], 3), np.uint8)
    part = picture[: size[1], : size[0]]
    out[: part.shape[0], : part.shape[1]] = part
    out[-2:] = 255
    return out


def outline(picture: Image, cell: Cell, colour: tuple[int, int, int], width: int) -> None:
    """A rectangle of grid cells, drawn in place."""
    corners = (round(cell.left), round(cell.top)), (round(cell.right), round(cell.bottom))
    cv2.rectangle(picture, *corners, colour, width)


if __name__ == "__main__":
    raise SystemExit(main())
