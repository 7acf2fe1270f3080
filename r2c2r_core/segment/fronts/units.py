"""Panel choice with a size prior: a dishwasher is one front, in spite of lines on it."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.calibration import probability
from r2c2r_core.kitchen.category import Category
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the unit choice."""

    edge_weight: float = param(0.5, "ratio", "Weight of the network's log-odds of an edge: the cut has used them already", gt=0)
    seam_worth: float = param(
        -3.0,
        "log",
        "Log-likelihood of an upright seam from top to bottom inside",
        source="one machine in twenty has one: a control strip at its side",
    )
    row_worth: float = param(1.0, "log", "Log-likelihood gain of an upper or lower edge aligned with an adjacent front's")
    same_area: float = param(
        0.85, "share", "Minimum area relative to the largest: smaller is nested, larger differs by a strip of shadow"
    )
    nested_worth: float = param(
        1.0, "log", "Maximum log-likelihood advantage of a window inside a front: of equals the outermost is the front"
    )
    row_m: float = param(0.015, "m", "Maximum misalignment of the fronts of a row")
    tall_m: float = param(0.35, "m", "Minimum height of a front that is one of a row side by side")
    lit_share: float = param(
        0.125, "share", "Mean fraction of the rows of black glass that have depth", gt=0, source="ovens: a strip of controls"
    )
    lit_row: float = param(0.9, "share", "Minimum fraction of a row with depth for it not to be black glass")
    about_m: float = param(0.02, "m", "Distance around a click within which depth tells black glass")


def unit_cell(run: Run, column: float, row: float, unit: Category) -> Cell | None:
    """Likeliest rectangle of a unit's category between lines of the run around a click."""
    params = tuned(Params)
    cell_m = run.grid.cell_m
    widest, tallest = unit.width.high / cell_m, unit.height.high / cell_m
    lefts = sorted({cell.left for cell in run.cells if cell.left < column and column - cell.left < widest})
    rights = sorted({cell.right for cell in run.cells if cell.right > column and cell.right - column < widest})
    tops = sorted({cell.top for cell in run.cells if cell.top < row and row - cell.top < tallest})
    bottoms = sorted({cell.bottom for cell in run.cells if cell.bottom > row and cell.bottom - row < tallest})
    options = [
        Cell(left, top, right, bottom)
        for left in lefts
        for right in rights
        if unit.width.holds((right - left) * cell_m)
        for top in tops
        for bottom in bottoms
        if unit.height.holds((bottom - top) * cell_m)
    ]
    lit_worth = 0.0 if _returns_light(run, column, row) else -1 / params.lit_share
    rated = [(_worth(run, cell, unit) + lit_worth * _lit(run, cell), cell) for cell in options]
    best = max((worth for worth, _ in rated), default=-np.inf)
    equal = [(worth, cell) for worth, cell in rated if worth > best - params.nested_worth]
    largest = max((cell.width * cell.height for _, cell in equal), default=0.0)
    outer = [(worth, cell) for worth, cell in equal if cell.width * cell.height > params.same_area * largest]
    return max(outer, key=lambda option: option[0])[1] if outer else None


def _returns_light(run: Run, column: float, row: float) -> bool:
    """Whether most of the surroundings of a click have depth."""
    reach = tuned(Params).about_m / run.grid.cell_m
    return _seen(run, Cell(column - reach, row - reach, column + reach, row + reach)).mean() > 0.5


def _lit(run: Run, cell: Cell) -> float:
    """Fraction of a rectangle's rows that have depth from end to end."""
    return float((_seen(run, cell).mean(axis=1) > tuned(Params).lit_row).mean())


def _seen(run: Run, cell: Cell) -> Mask:
    rows, columns = (slice(max(round(a), 0), round(b) + 1) for a, b in ((cell.top, cell.bottom), (cell.left, cell.right)))
    return run.seen[rows, columns]


def _worth(run: Run, cell: Cell, unit: Category) -> float:
    """Log-likelihood of a rectangle as such a unit: of its edges, inner seam, size, and alignment."""
    params = tuned(Params)
    cell_m = run.grid.cell_m
    off = np.array([unit.width.deviation(cell.width * cell_m), unit.height.deviation(cell.height * cell_m)])
    edges = params.edge_weight * sum(run.odds.of_edges(cell)) + params.seam_worth * _seam_inside(run, cell)
    return edges - 0.5 * float(off @ off) + params.row_worth * _in_row(run, cell)


def _seam_inside(run: Run, cell: Cell) -> float:
    """Probability of the likeliest upright line of the run that would split a rectangle from top to bottom."""
    slack = tuned(Params).row_m / run.grid.cell_m
    inside = {other.left for other in run.cells if cell.left + slack < other.left < cell.right - slack}
    odds = max((float(run.odds.along(0, at, cell.top, cell.bottom).mean()) for at in inside), default=-np.inf)
    return probability(odds)


def _in_row(run: Run, cell: Cell) -> int:
    """Number of a rectangle's upper and lower edges shared with an adjacent front: units are made to fit a row of cupboards."""
    params = tuned(Params)
    slack, tall = params.row_m / run.grid.cell_m, params.tall_m / run.grid.cell_m
    beside = [
        other
        for other in run.cells
        if other.height > tall and min(abs(other.right - cell.left), abs(other.left - cell.right)) < 3 * slack
    ]
    return any(abs(other.top - cell.top) < slack for other in beside) + any(
        abs(other.bottom - cell.bottom) < slack for other in beside
    )
