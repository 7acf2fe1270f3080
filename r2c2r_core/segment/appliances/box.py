"""Appliance front on the orthomosaic: the rectangle of plausible size with the clearest edges; its box and its masks."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.rectangle import TOWARDS
from r2c2r_core.model.track import ThingBox
from r2c2r_core.segment.fronts.front import Front, side_corners, side_faces
from r2c2r_core.segment.mosaics.lines import Evidence
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.occlusion import Facet, Tolerance, visible_mask
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the rectangle search."""

    candidates: int = param(36, "count", "Number of candidate lines per direction", ge=2)
    shadow_m: float = param(
        0.02,
        "m",
        "Minimum distance of a line above the support: nearer lines are the edge of its shadow",
        source="without it a microwave of the sample kitchens (seed 0) loses 8 mm of its height",
    )
    covered: float = param(
        0.35,
        "score",
        "Weight of the observed plane area that a rectangle covers, relative to 1 for four clear edges",
        source="0.2 to 0.5 work on kitchens of both generators; 0 loses a microwave, 0.6 makes refrigerators 20 mm high",
    )
    reach: float = param(
        0.4, "ratio", "Search distance for lines beyond the clicks, relative to the smallest side of the category"
    )
    usual: float = param(
        0.3,
        "score",
        "Weight of a usual size, relative to 1 for four clear edges",
        source="without it the same microwave loses 42 mm of its height",
    )
    past: float = param(
        2.0,
        "score",
        "Cost of a rectangle that depth looks past everywhere, relative to 1 for four clear edges",
        source="at 0 a microwave of a third party's kitchen takes in the wall's edge beside it; at 2 it is right to 1 %",
    )
    refused: float = param(10.0, "score", "Cost of a negative click inside the rectangle")
    sure_z: float = param(4.0, "σ", "z-score at which a line counts as fully clear", gt=0)
    clearest_z: float = param(6.0, "σ", "Maximum z-score counted while candidate lines are searched", gt=0)
    least_line: float = param(0.2, "σ", "Minimum mean z-score of a candidate line")
    blur_m: float = param(0.003, "m", "Standard deviation of the smoothing of the line profile, within which lines merge", gt=0)
    apart_m: float = param(0.0075, "m", "Minimum distance between candidate lines")
    front_m: float = param(0.08, "m", "Minimum distance of depth in front of the box for an occluder")
    behind_m: float = param(0.06, "m", "Minimum distance of depth behind the box for the box to be seen through")
    least_visible: float = param(0.05, "share", "Minimum visible fraction of the box's projection for a mask")


def find_rectangle(
    run: Run, clicks: np.ndarray, kind: Category, refused: np.ndarray, past: Mask, support_row: float | None = None
) -> Cell | None:
    """Rectangle (grid cells) around the clicks with the clearest four edges, of plausible size, above its support.

    `past` marks the cells that depth looks past: an appliance has none.
    """
    params = tuned(Params)
    cell_m = run.grid.cell_m
    low, high = clicks.min(axis=0), clicks.max(axis=0)
    part = _component(run, clicks)
    vertical, horizontal = _sums(run.vertical), _sums(run.horizontal)
    columns = _candidates(run.vertical, low[1], high[1], params.reach * kind.height.low / cell_m, cell_m)
    rows = _candidates(run.horizontal, low[0], high[0], params.reach * kind.width.low / cell_m, cell_m)
    if support_row is not None:
        rows = np.append(rows[rows < support_row - params.shadow_m / cell_m], support_row)
    support, empty = (np.pad(cells.astype(np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0))) for cells in (part, past))
    best: tuple[float, Cell] | None = None
    for left in columns[columns < low[0]]:
        for right in columns[columns > high[0]]:
            width = (right - left) * cell_m
            if not kind.width.allows(width):
                continue
            tops, bottoms = rows[rows < low[1]], rows[rows > high[1]]
            top, bottom = (grid.ravel() for grid in np.meshgrid(tops, bottoms, indexing="ij"))
            tall = (bottom - top) * cell_m
            fits = kind.height.allows(tall)
            if not fits.any():
                continue
            top, bottom, tall = top[fits], bottom[fits], tall[fits]
            foot = _along_rows(horizontal, bottom, left, right, run.horizontal.block)
            if support_row is not None:
                foot = np.where(bottom == support_row, 1.0, foot)  # depth shows the support: as certain as a line can be
            edges = (
                _along(vertical, left, top, bottom, run.vertical.block)
                + _along(vertical, right, top, bottom, run.vertical.block)
                + _along_rows(horizontal, top, left, right, run.horizontal.block)
                + foot
            ) / 4
            usual = np.exp(-0.5 * (kind.height.deviation(tall) ** 2 + kind.width.deviation(width) ** 2))
            score = edges + params.usual * usual + params.covered * _covered(support, left, right, top, bottom)
            score = score - params.past * _held(empty, left, right, top, bottom) / np.maximum(
                (right - left) * (bottom - top), 1
            )
            for column, row in refused:
                score = score - params.refused * ((left < column < right) & (top < row) & (row < bottom))
            i = int(np.argmax(score))
            if best is None or score[i] > best[0] + 1e-9:
                best = (float(score[i]), Cell(float(left), float(top[i]), float(right), float(bottom[i])))
    return best[1] if best else None


def appliance_mask(front: Front, scene: Scene, frame: Frame) -> tuple[Mask, float]:
    """Visible pixels of the box in a frame, and the visible fraction of its projection."""
    params, grid = tuned(Params), front.run.grid
    face = grid.rectangle(front.cell, front.run.slide_of(frame.index, scene))
    facets = []
    if (frame.world_from_camera.translation - grid.world_from_plane.translation) @ grid.outward > 0.03:
        facets.append(Facet(face.corners))
    for side in TOWARDS:
        if side_faces(front.outline, side, frame.world_from_camera.translation):
            facets.append(Facet(side_corners(face, side, front.depth_m)))
    mask, share = visible_mask(facets, scene, frame, Tolerance(front_m=params.front_m, behind_m=params.behind_m))
    if share < params.least_visible:
        return np.zeros_like(mask), 0.0
    return mask, share


def appliance_box(front: Front, *, depth_seen: bool) -> ThingBox:
    """Box in the world: the front rectangle extruded by its depth."""
    face = front.rectangle.at(Rigid3(np.eye(3), np.array([0.0, front.depth_m / 2, 0.0])))
    return ThingBox(
        world_from_object=face.world_from_front,
        dimensions_m=np.array([face.width_m, front.depth_m, face.height_m]),
        support_z_m=float(face.centre[2] - face.height_m / 2),
        depth_seen=depth_seen,
    )


def _component(run: Run, clicks: np.ndarray) -> np.ndarray:
    """Observed part of the plane under the clicks, else the one nearest to the first click."""
    count, labels = cv2.connectedComponents(run.seen.astype(np.uint8), connectivity=4)
    if count <= 1:
        return np.zeros_like(run.seen)
    row = np.clip(clicks[:, 1].astype(int), 0, run.seen.shape[0] - 1)
    column = np.clip(clicks[:, 0].astype(int), 0, run.seen.shape[1] - 1)
    under = [label for label in labels[row, column].tolist() if label > 0]
    if under:
        return np.asarray(np.isin(labels, under))
    distance = [np.inf, *(_distance(labels == label, clicks[0]) for label in range(1, count))]
    return np.asarray(labels == int(np.argmin(distance)))


def _distance(part: np.ndarray, click: np.ndarray) -> float:
    rows, columns = np.nonzero(part)
    return float(np.hypot(columns - click[0], rows - click[1]).min())


def _covered(support: np.ndarray, left: float, right: float, top: np.ndarray, bottom: np.ndarray) -> np.ndarray:
    """Fraction of the observed part inside each rectangle."""
    return np.asarray(_held(support, left, right, top, bottom) / max(float(support[-1, -1]), 1.0))


def _held(sums: np.ndarray, left: float, right: float, top: np.ndarray, bottom: np.ndarray) -> np.ndarray:
    """Number of cells inside each rectangle, from running sums over both axes."""
    a, b, c, d = round(left), round(right), np.round(top).astype(int), np.round(bottom).astype(int)
    return np.asarray(sums[d, b] - sums[c, b] - sums[d, a] + sums[c, a])


def _sums(evidence: Evidence) -> np.ndarray:
    """Running sums over blocks of the line clarity at each position (0..1), the best of three neighbours."""
    sure = tuned(Params).sure_z
    clear = cv2.dilate(np.clip(evidence.score, 0, sure).astype(np.float32), np.ones((1, 3), np.uint8)) / sure
    return np.pad(np.where(evidence.known, clear, 0).cumsum(axis=0), ((1, 0), (0, 0)))


def _along(sums: np.ndarray, column: float, top: np.ndarray, bottom: np.ndarray, block: int) -> np.ndarray:
    first, last = np.floor(top / block).astype(int), np.ceil(bottom / block).astype(int)
    first, last = first.clip(0, len(sums) - 2), last.clip(1, len(sums) - 1)
    at = min(max(int(column), 0), sums.shape[1] - 1)
    return np.asarray((sums[last, at] - sums[first, at]) / np.maximum(last - first, 1))


def _along_rows(sums: np.ndarray, rows: np.ndarray, left: float, right: float, block: int) -> np.ndarray:
    first, last = int(np.clip(left // block, 0, len(sums) - 2)), int(np.clip(np.ceil(right / block), 1, len(sums) - 1))
    at = rows.astype(int).clip(0, sums.shape[1] - 1)
    return np.asarray((sums[last, at] - sums[first, at]) / max(last - first, 1))


def _candidates(evidence: Evidence, low: float, high: float, reach: float, cell_m: float) -> np.ndarray:
    """Positions (cell centres) of the clearest lines on either side of the clicks; clicks may lie near the border."""
    params = tuned(Params)
    around = 2 * round(params.apart_m / cell_m) + 1
    if max(low - reach, 0) // evidence.block >= len(evidence.score):
        return np.zeros(0)  # the clicks lie outside the observed part
    before, after = (_shown(evidence, *span) for span in ((low - reach, high), (low, high + reach)))
    profile = cv2.GaussianBlur(np.maximum(before, after)[None].astype(np.float32), (0, 0), params.blur_m / cell_m)[0]
    peak = (profile >= cv2.dilate(profile[None], np.ones((1, around), np.uint8))[0] - 1e-6) & (profile > params.least_line)
    positions = np.flatnonzero(peak)
    order = np.argsort(-profile[positions], kind="stable")[: params.candidates]
    return np.sort(positions[order]) + 0.5


def _shown(evidence: Evidence, low: float, high: float) -> np.ndarray:
    """Line clarity of each position between two places along the line."""
    count = len(evidence.score)
    first = int(np.clip(low // evidence.block, 0, count - 1))
    last = int(np.clip(np.ceil(high / evidence.block), first + 1, count))
    clear = np.clip(evidence.score[first:last], 0, tuned(Params).clearest_z)
    return np.asarray(np.where(evidence.known[first:last], clear, 0).mean(axis=0))
