"""Panels of a run: cut one by one, then along faint lines that the panels of a row share."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.runs.xy_cut import Line, LineField, across, cut_alone, halves
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of shared lines. Odds are natural logarithms."""

    in_line_m: float = param(
        0.006, "m", "Maximum misalignment of panel ends in one row", gt=0, source="as exactly as lines are placed"
    )
    most: float = param(2.0, "log", "Maximum absolute log-odds that one panel contributes to a line of its row", gt=0)
    least: float = param(-1.0, "log", "Minimum log-odds of a line in a panel for the line of its row to cut it too")


def cut_panels(odds: PanelOdds, grid: Cell, cell_m: float) -> list[Cell]:
    """Panels of a grid, as rectangles that tile it."""
    field = LineField(odds, cell_m)
    found = cut_alone(field, grid)
    for axis in (1, 0):
        for end in (0, 1):
            for row in _rows(field, found, axis, end):
                for cell, line in _shared_lines(field, row, axis):
                    found.remove(cell)
                    found += halves(cell, line)
    return found


def _rows(field: LineField, cells: Sequence[Cell], axis: int, end: int) -> list[list[Cell]]:
    """Rows of fronts whose lower (0) or upper (1) ends along an axis are aligned."""
    slack = tuned(Params).in_line_m / field.cell_m * STEP
    rows: list[list[Cell]] = []
    for cell in sorted(filter(field.is_front, cells), key=lambda cell: across(cell, axis)[end]):
        if rows and across(cell, axis)[end] - across(rows[-1][-1], axis)[end] < slack:
            rows[-1].append(cell)
        else:
            rows.append([cell])
    return [row for row in rows if len(row) > 1]


def _shared_lines(field: LineField, row: Sequence[Cell], axis: int) -> list[tuple[Cell, Line]]:
    """Likeliest line at one position in all cells of a row, for the cells that may have it; none where it is unlikely.

    The evidence counts for each cell, the prior once: rows are made alike.
    """
    params, length = tuned(Params), field.odds[axis].shape[1]
    seen, usual = [], []
    for cell in row:
        evidence = field.evidence(cell, axis)
        odds, prior = np.full(length, -params.most), np.full(length, np.nan)
        if evidence is not None:
            inside = slice(evidence.start, evidence.start + len(evidence.odds))
            near = np.max(
                sliding_window_view(np.pad(evidence.odds, 1, mode="edge"), 3), axis=1
            )  # lines deviate by up to a cell
            odds[inside], prior[inside] = np.clip(near, -params.most, params.most), evidence.prior
        seen.append(odds)
        usual.append(prior)
    count = np.isfinite(usual).sum(axis=0)
    total = np.where(count > 0, np.sum(seen, axis=0) + np.nansum(usual, axis=0) / np.maximum(count, 1), -np.inf)
    best = int(np.argmax(total))
    if total[best] <= 0:
        return []
    found = []
    for cell, odds in zip(row, seen, strict=True):
        line = field.best_between(cell, axis, (best - 1) * STEP, (best + 2) * STEP) if odds[best] > params.least else None
        if line is not None and across(cell, axis)[0] + STEP <= line.position <= across(cell, axis)[1] - STEP:
            found.append((cell, line))
    return found
