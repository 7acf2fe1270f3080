"""Completion of frame-and-panel fronts: a strip beside a panel that is a stile or rail of its frame joins it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.segment.mosaics.lines import Evidence
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell, joined
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.segment.runs.contrast import CORNER, Contrast
from r2c2r_core.segment.runs.face_frames import is_rail, shows
from r2c2r_core.segment.runs.xy_cut import LineField, across
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of frames. Scores are z-scores of a line over the blocks along it."""

    narrowest_m: float = param(
        0.03, "m", "Minimum width of stiles and rails", gt=0, source="frames of doors sold are 50-90 mm wide"
    )
    widest_m: float = param(
        0.12, "m", "Maximum width of stiles and rails", gt=0, source="frames of doors sold are 50-90 mm wide"
    )
    alike_m: float = param(
        0.025, "m", "Maximum difference between the widths of two stiles of one front: sunk panels shift with the view"
    )
    in_line_m: float = param(0.015, "m", "Maximum difference between the ends of a strip and of its front")
    panel_line: float = param(
        0.7, "σ", "Minimum score of a visible line around a panel", source="lines of development kitchens"
    )
    none_share: float = param(0.5, "share", "Fraction of a visible line's score below which there is no line")
    sunk_m: float = param(
        0.003,
        "m",
        "Minimum distance of a panel behind its frame",
        gt=0,
        source="6-12 mm are usual; a strip's mean depth is known to 1 mm",
    )
    beside_m: tuple[float, float] = param(
        (0.005, 0.025), "m", "Minimum and maximum distance from a line of the depth that is compared beside it"
    )
    min_observed_ratio: float = param(
        0.25,
        "ratio",
        "Minimum number of depth points on one side of a line, relative to the other, to measure a step",
        gt=0,
        lt=1,
    )
    edge: float = param(-1.0, "log", "Minimum log-odds of a frame's outer edge")
    middle: float = param(0.6, "share", "Fraction of a side over whose middle lines count: corners have other lines")


def whole_frames(
    odds: PanelOdds,
    cells: Sequence[Cell],
    cell_m: float,
    lines: tuple[Evidence, Evidence],
    contrast: Contrast,
    relief: Relief,
) -> list[Cell]:
    """Cells with frame strips joined to their panels; `lines` are the evidence of upright and of level lines.

    Where the gaps at a front's other sides end, the strip is not part of it but a rail of the face frame that it is inset in.
    """
    params, field, found = tuned(Params), LineField(odds, cell_m), list(cells)
    for front in filter(field.is_front, cells):
        grown = front
        for axis, end in ((0, 0), (0, 1), (1, 0), (1, 1)):
            strip = _strip_beside(field, found, grown, axis, end)
            if grown not in found or strip is None or is_rail(contrast, grown, strip, axis):
                continue
            at_corners = _shares_at_corners(contrast, grown, axis, end, cell_m)
            if min(at_corners) > params.none_share:  # it reaches the other sides, as a gap does
                continue
            sunk = _is_sunk(contrast, relief, grown, axis, end, cell_m)
            ends = sunk and max(at_corners) < params.none_share
            if ends or _is_stile(field, grown, strip, lines, axis, end, sunk):
                found.remove(grown)
                found = [part for other in found for part in _without(other, strip)]
                grown = joined([grown, strip])
                found.append(grown)
    return found


def _step_at(relief: Relief, front: Cell, axis: int, at: float, away: int, cell_m: float) -> float:
    """Depth step in metres (positive: farther back) beyond a position, along the middle of a front's span.

    0 where depth hardly saw the plane on one of the two sides.
    """
    params, (low, high) = tuned(Params), across(front, 1 - axis)
    margin, counts, level = (high - low) * (1 - params.middle) / 2, [], []
    for side in (-away, away):
        start, stop = sorted(at + side * size / cell_m for size in params.beside_m)
        span = (start, low + margin, stop, high - margin) if axis == 0 else (low + margin, start, high - margin, stop)
        points, total = relief.levels_over(Cell(*span))
        counts.append(points)
        level.append(total / max(points, 1.0))
    return float(level[0] - level[1]) if min(counts) > params.min_observed_ratio * max(counts) else 0.0


def _strip_beside(field: LineField, cells: Sequence[Cell], front: Cell, axis: int, end: int) -> Cell | None:
    """Strip beside one end of a front up to the next line that may belong to its frame; None where there is none."""
    params = tuned(Params)
    (low, high), beside = across(front, axis), across(front, 1 - axis)
    near, away = (high, 1) if end else (low, -1)
    narrowest, widest, slack = (size * STEP / field.cell_m for size in (params.narrowest_m, params.widest_m, params.in_line_m))
    for other in cells:
        reaches, spans = across(other, axis), across(other, 1 - axis)
        in_line = max(abs(spans[0] - beside[0]), abs(spans[1] - beside[1])) < slack
        if not in_line or abs(reaches[1 - end] - near) > 1 or abs(reaches[end] - near) < narrowest:
            continue
        far = reaches[end]
        if abs(far - near) > widest:
            start, stop = sorted((near + away * narrowest, near + away * widest))
            edge = None if field.is_front(other) else field.likeliest(other, axis, start, stop)
            if edge is None or edge[1] < params.edge:
                continue
            far = edge[0]
        first, last = sorted((near, far))
        return Cell(first, beside[0], last, beside[1]) if axis == 0 else Cell(beside[0], first, beside[1], last)
    return None


def _shares_at_corners(contrast: Contrast, front: Cell, axis: int, end: int, cell_m: float) -> list[float]:
    """Contrast of the line at one end of a front beside its other sides, relative to its middle; 0: it ends before."""
    params, at, (low, high) = tuned(Params), across(front, axis)[end], across(front, 1 - axis)
    corner = params.narrowest_m / cell_m
    inner = float(np.median(contrast.along(axis, at, low + corner, high - corner)))
    spans = (low + CORNER, low + corner), (high - corner, high - CORNER)
    corners = [float(np.median(contrast.along(axis, at, *span))) for span in spans]
    return [corner / max(inner, 1e-9) for corner in corners]


def _is_sunk(contrast: Contrast, relief: Relief, front: Cell, axis: int, end: int, cell_m: float) -> bool:
    """Whether depth shows a front behind the strip beside one end of it, at a visible line."""
    params, at, (low, high) = tuned(Params), across(front, axis)[end], across(front, 1 - axis)
    margin, out = (high - low) * (1 - params.middle) / 2, 1 if end else -1
    step = _step_at(relief, front, axis, at, -out, cell_m)
    return step > params.sunk_m and shows(contrast, axis, at, low + margin, high - margin)


def _is_stile(
    field: LineField, front: Cell, strip: Cell, lines: tuple[Evidence, Evidence], axis: int, end: int, sunk: bool
) -> bool:
    """Whether lines at a front's other three sides are as far inside as the strip is wide, with none inside the strip's side.

    Where depth shows the panel sunk, one of the three may be invisible in the light.
    """
    params, cell_m = tuned(Params), field.cell_m / STEP
    (low, high), beside = across(front, axis), across(front, 1 - axis)
    near, away = (high, -1) if end else (low, 1)  # inwards
    opposite = low if end else high
    width = across(strip, axis)[1] - across(strip, axis)[0]
    alike, narrowest, widest = (size / cell_m for size in (params.alike_m, params.narrowest_m, params.widest_m))
    if high - low < 2 * width or beside[1] - beside[0] < 2 * narrowest:
        return False

    def clearest(of: int, span: tuple[float, float], *positions: float) -> float:
        return _clearest(lines[of], span, min(positions), max(positions))

    least = max(width - alike, narrowest), min(width + alike, widest)
    around = (
        clearest(axis, beside, *(opposite - away * offset for offset in least)),
        clearest(1 - axis, (low, high), beside[0] + narrowest, beside[0] + widest),
        clearest(1 - axis, (low, high), beside[1] - widest, beside[1] - narrowest),
    )
    shown = sorted(around)[int(sunk)]
    inside = clearest(axis, beside, near + away * narrowest, near + away * widest)
    return shown > params.panel_line and inside < params.none_share * shown


def _clearest(lines: Evidence, span: tuple[float, float], start: float, stop: float) -> float:
    """Maximum, over lines from `start` to `stop`, of the median score along the middle of a span."""
    margin = (span[1] - span[0]) * (1 - tuned(Params).middle) / 2
    first = int((span[0] + margin) / lines.block)
    blocks = slice(first, max(int((span[1] - margin) / lines.block), first + 1))
    positions = slice(max(int(start), 0), int(stop) + 1)
    score = np.where(lines.known[blocks, positions], lines.score[blocks, positions], 0.0)
    return float(np.median(score, axis=0).max(initial=0.0)) if len(score) else 0.0


def _without(cell: Cell, strip: Cell) -> list[Cell]:
    """Remaining parts of a cell crossed by a strip."""
    left, right = max(cell.left, strip.left), min(cell.right, strip.right)
    top, bottom = max(cell.top, strip.top), min(cell.bottom, strip.bottom)
    if right - left < 1 or bottom - top < 1:
        return [cell]
    parts = (
        Cell(cell.left, cell.top, left, cell.bottom),
        Cell(right, cell.top, cell.right, cell.bottom),
        Cell(left, cell.top, right, top),
        Cell(left, bottom, right, cell.bottom),
    )
    return [part for part in parts if part.width > 0 and part.height > 0]
