"""Fronts inset in a face frame: gaps on all sides, of which those at two sides end at a rail or stile of the frame.

A sunk panel of a front has lines on all sides too, but there the front's own borders continue beside its rails and stiles.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.segment.runs.contrast import CORNER, SIDES, Contrast, edges_of
from r2c2r_core.segment.runs.panels import cut_panels
from r2c2r_core.segment.runs.xy_cut import LineField, across
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of face frames. Contrasts are lightness, 0 to 255, of a line against both of its sides."""

    narrowest_m: float = param(0.014, "m", "Minimum width of rails and stiles", gt=0, source="a cut leaves no less")
    widest_m: float = param(
        0.1, "m", "Maximum width of rails and stiles", gt=0, source="two stiles of 38-50 mm stand side by side"
    )
    smallest_m: float = param(0.06, "m", "Minimum side of an inset front", gt=0)
    contrast: float = param(
        1.0, "grey", "Minimum contrast of a gap", gt=0, source="noise of mosaics along 30 mm of a line is 0.3"
    )
    alike: float = param(
        0.4,
        "ratio",
        "Minimum contrast of a gap's faintest part relative to its median, and of a gap relative to the clearest one",
        gt=0,
        source="noise of mosaics along 30 mm of a line is 0.3",
    )
    ended: float = param(
        0.6,
        "ratio",
        "Maximum change beside a rail where a gap would continue, relative to the gap's contrast, for the gap to have ended",
        gt=0,
        source="development kitchens: 0.0 to 0.55 on face frames, mostly grain; 0.8 to 1.3 where a front's own borders go on",
    )
    other: float = param(
        2.0,
        "ratio",
        "Change beside a front, relative to its edge's contrast, above which it is another edge: a worktop's or a wall's",
        gt=0,
        source="development kitchens: 3.4 to 4 under worktops",
    )
    flush_m: float = param(
        0.005,
        "m",
        "Maximum distance of a front's border behind its face frame: deeper is the panel of a frame",
        gt=0,
        source="fronts are inset flush within 2 mm; the mean depth over a border is known to 1 mm",
    )
    border_m: tuple[float, float] = param(
        (0.01, 0.035), "m", "Minimum and maximum distance from a front's edge of its border: a front's own panel begins later"
    )
    options: int = param(3, "count", "Maximum number of lines beside an edge, the clearest, that are tried as the gap", ge=1)


def inset_fronts(contrast: Contrast, relief: Relief, odds: PanelOdds, cells: Sequence[Cell], cell_m: float) -> list[Cell]:
    """Cells in which inset fronts are separated from the rails or stiles of their face frames."""
    field, found = LineField(odds, cell_m), list[Cell]()
    for cell in cells:
        front = _inset(contrast, field, cell, cell_m) if field.is_front(cell) else None
        if front is not None and _is_sunk(relief, front, cell, cell_m):
            front = None
        if front is None:
            found.append(cell)
            continue
        within = cut_panels(odds, front, cell_m)  # lines from side to side of a front may end before the frame's borders
        found += [front] if len(within) == 1 else inset_fronts(contrast, relief, odds, within, cell_m)
        found += _around(front, cell)
    return found


def is_rail(contrast: Contrast, front: Cell, strip: Cell, axis: int) -> bool:
    """Whether a strip beside a front belongs to its face frame: a gap separates them, and the front's side gaps end there."""
    params, ends = tuned(Params), across(front, axis)
    strip_ends, others = across(strip, axis), across(front, 1 - axis)
    own = [float(np.median(contrast.along(1 - axis, at, ends[0] + CORNER, ends[1] - CORNER))) for at in others]
    shared = ends[0] if strip_ends[0] < ends[0] else ends[1]
    between = float(np.median(contrast.along(axis, shared, others[0] + CORNER, others[1] - CORNER)))
    if min(own) < params.contrast or between < params.alike * max(own):
        return False
    return all(_ends(contrast, 1 - axis, at, strip_ends, gap) for at, gap in zip(others, own, strict=True))


def _inset(contrast: Contrast, field: LineField, cell: Cell, cell_m: float) -> Cell | None:
    """Largest front inset in a cell, framed on the most sides (at most three); None where there is none.

    Its gaps may be faint. A line that the network rules out as an edge is grain, unless it is the clearest one at its side and
    at least as clear as another gap of the front.
    """
    smallest, best = tuned(Params).smallest_m / cell_m, (0, 0.0, cell)
    options, grain = list[list[float]](), list[float | None]()
    for side, border in zip(SIDES, edges_of(cell), strict=True):
        lines = lines_beside(contrast, cell, side, cell_m)
        possible = [line for line in lines if field.is_possible(cell, side[0], line)]
        grain.append(lines[0] if lines and lines[0] not in possible else None)
        options.append([border, *lines[: grain[-1] is not None], *possible])
    for edges in product(*options):
        left, right, top, bottom = edges
        front = Cell(left, top, right, bottom)
        moved = [edge != border for edge, border in zip(edges, edges_of(cell), strict=True)]
        doubted = [edge == line for edge, line in zip(edges, grain, strict=True)]
        worth = (sum(moved), front.width * front.height)
        large = min(front.width, front.height) >= smallest
        if worth > best[:2] and sum(moved) < 4 and large and _is_inset(contrast, front, cell, moved, doubted):
            best = (*worth, front)
    return best[2] if best[0] else None


def shows(contrast: Contrast, axis: int, at: float, low: float, high: float) -> bool:
    """Whether a line near a position is visible over most of a span."""
    return bool(np.median(contrast.along(axis, at, low, high)) >= tuned(Params).contrast)


def lines_beside(contrast: Contrast, cell: Cell, side: tuple[int, int], cell_m: float) -> list[float]:
    """Positions of lines beside one edge of a cell that are visible along its middle, the clearest first."""
    params, (axis, end) = tuned(Params), side
    (low, high), beside = across(cell, axis), across(cell, 1 - axis)
    widest = params.widest_m / cell_m
    reach = min(widest, (high - low) / 3)
    corner = min(widest, (beside[1] - beside[0]) / 4)
    near, far = (high - params.narrowest_m / cell_m, high - reach) if end else (low + params.narrowest_m / cell_m, low + reach)
    first, last = round(min(near, far)), round(max(near, far))
    if (far - near) * (-1 if end else 1) < 3:
        return []
    seen = cv2.dilate(contrast.near(axis, first, last, beside[0] + corner, beside[1] - corner), np.ones((1, 3), np.uint8))
    score = np.sort(seen, axis=0)[1]  # a handle may hide one part
    peaks = [i for i in range(len(score)) if score[i] >= params.contrast and score[i] == score[max(i - 3, 0) : i + 4].max()]
    apart = [i for k, i in enumerate(peaks) if k == 0 or i - peaks[k - 1] > 3]
    return [first + i + 0.5 for i in sorted(apart, key=lambda i: -score[i])[: params.options]]


def _is_sunk(relief: Relief, front: Cell, cell: Cell, cell_m: float) -> bool:
    """Whether depth shows the border of a supposed front behind its surroundings in the cell: then it is a frame's panel."""
    params = tuned(Params)
    near, far = (size / cell_m for size in params.border_m)
    border = _mean_level(relief, _shrunk(front, near), _shrunk(front, far))
    frame = _mean_level(relief, cell, _within(_shrunk(front, -near / 2), cell))
    return border is not None and frame is not None and border < frame - params.flush_m


def _mean_level(relief: Relief, outer: Cell, inner: Cell) -> float | None:
    """Mean depth, outwards, of the points between two nested rectangles; None without any."""
    points, total = relief.levels_over(outer) - relief.levels_over(inner)
    return float(total / points) if points > 0 else None


def _shrunk(cell: Cell, by: float) -> Cell:
    return Cell(cell.left + by, cell.top + by, cell.right - by, cell.bottom - by)


def _within(cell: Cell, outer: Cell) -> Cell:
    return Cell(
        max(cell.left, outer.left), max(cell.top, outer.top), min(cell.right, outer.right), min(cell.bottom, outer.bottom)
    )


def _is_inset(contrast: Contrast, front: Cell, cell: Cell, moved: Sequence[bool], doubted: Sequence[bool]) -> bool:
    """Whether a front has gaps from corner to corner at its inset sides, and the gaps at its other sides end there.

    A doubted gap must be as clear as one at a side that is not inset.
    """
    params = tuned(Params)
    parts = [
        contrast.along(axis, edge, across(front, 1 - axis)[0] + CORNER, across(front, 1 - axis)[1] - CORNER)
        for (axis, _), edge in zip(SIDES, edges_of(front), strict=True)
    ]
    usual = [float(np.median(each)) for each in parts]
    beside = {k: _beyond(contrast, front, cell, moved, k) for k in range(len(SIDES))}
    unmoved = [own for k, own in enumerate(usual) if not moved[k] and not _is_other(beside[k], own)]
    clear = max(unmoved, default=0.0)
    faint = min((own for own in unmoved if own >= max(params.alike * clear, params.contrast)), default=np.inf)
    for each, own, inner, doubt in zip(parts, usual, moved, doubted, strict=True):
        if doubt and own < faint - params.contrast:
            return False
        faintest = min(np.sort(each)[1], each[0], each[-1])  # a handle may hide one part, but not at a corner
        if inner and (faintest < max(params.alike * own, params.contrast) or own < params.alike * clear):
            return False
    for of in (0, 1):
        told = [k for k, (axis, _) in enumerate(SIDES) if axis != of and beside[k] and not _is_other(beside[k], usual[k])]
        if any(moved[k] for k, (axis, _) in enumerate(SIDES) if axis == of) and not told:
            return False  # nothing distinguishes a rail from a part of the front
        if not all(usual[k] >= params.contrast and max(beside[k]) <= params.ended * usual[k] for k in told):
            return False
    return True


def _beyond(contrast: Contrast, front: Cell, cell: Cell, moved: Sequence[bool], side: int) -> list[float]:
    """Changes across the strips beside a front, where one of its edges would continue."""
    axis, at = SIDES[side][0], edges_of(front)[side]
    return [_change(contrast, axis, at, strip) for strip in _strips(front, cell, moved, 1 - axis)]


def _is_other(beside: Sequence[float], own: float) -> bool:
    """Whether the change beside a front far exceeds its own edge's: not a continuing gap, but a worktop or a wall."""
    return max(beside, default=0.0) > tuned(Params).other * own


def _strips(front: Cell, cell: Cell, moved: Sequence[bool], axis: int) -> Iterator[tuple[float, float]]:
    """Spans of the frame along an axis, at the inset edges of a front."""
    for (of, _), inner, edge, border in zip(SIDES, moved, edges_of(front), edges_of(cell), strict=True):
        if of == axis and inner:
            yield min(edge, border), max(edge, border)


def _ends(contrast: Contrast, axis: int, at: float, strip: tuple[float, float], own: float) -> bool:
    """Whether a gap of a given contrast is not visible across a strip."""
    return _change(contrast, axis, at, strip) <= tuned(Params).ended * own


def _change(contrast: Contrast, axis: int, at: float, strip: tuple[float, float]) -> float:
    """Maximum lightness change near a position across a strip."""
    corner = min(CORNER, (strip[1] - strip[0]) / 3)
    return float(contrast.changes(axis, at, strip[0] + corner, strip[1] - corner, 1).max())


def _around(inner: Cell, outer: Cell) -> list[Cell]:
    """Remaining parts of a cell around one within it."""
    parts = (
        Cell(outer.left, outer.top, outer.right, inner.top),
        Cell(outer.left, inner.bottom, outer.right, outer.bottom),
        Cell(outer.left, inner.top, inner.left, inner.bottom),
        Cell(inner.right, inner.top, outer.right, inner.bottom),
    )
    return [part for part in parts if part.width > 0 and part.height > 0]
