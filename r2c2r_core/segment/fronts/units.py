"""Panel choice with a prior on size: a dishwasher is one front whatever lines it carries, a drawer is one of a stack."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.kitchen.category import Category
from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What sizes and rows say for a panel."""

    usual_worth: float = param(
        0.6, "score", "of a usual size, beside 1 for an edge's clarity", source="as much as two and a half clear edges"
    )
    row_worth: float = param(0.15, "score", "of being one of a row")
    same_area: float = param(0.85, "share", "of the largest area: less is nested, more differs by a strip of shadow")
    nested_worth: float = param(
        0.08, "score", "by which a window inside a front may be clearer: of equals the outermost is the front"
    )
    row_m: float = param(0.015, "m", "how exactly the fronts of a row line up")
    tall_m: float = param(0.35, "m", "height from which a front is one of a row upright")
    lowest_drawer_m: float = param(0.09, "m", "height of the lowest drawer that is looked for")
    drawn_share: float = param(0.3, "share", "quantile over the blocks beside a handle: a seam shows in most of them")
    prominent: float = param(5.0, "σ", "robust, of a seam over its surroundings")
    least_z: float = param(0.35, "σ", "of a seam")


def unit_cell(run: Run, column: float, row: float, unit: Category) -> Cell | None:
    """The rectangle between lines of the run around a click of the size of such a unit, with the clearest edges."""
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
    rated = [(_worth(run, cell, unit), cell) for cell in options]
    best = max((worth for worth, _ in rated), default=0.0)
    equal = [(worth, cell) for worth, cell in rated if worth > best - params.nested_worth]
    largest = max((cell.width * cell.height for _, cell in equal), default=0.0)
    outer = [(worth, cell) for worth, cell in equal if cell.width * cell.height > params.same_area * largest]
    return max(outer, key=lambda option: option[0])[1] if outer else None


def drawer_cell(run: Run, cell: Cell, row: float) -> Cell:
    """The drawer at a row of a stack that was cut as one panel, its seams too faint where handles are."""
    seam = _seam(run, cell)
    if seam is None:
        return cell
    top, bottom = Cell(cell.left, cell.top, cell.right, seam), Cell(cell.left, seam, cell.right, cell.bottom)
    return drawer_cell(run, top if row < seam else bottom, row)


def line_clarity(run: Run, cell: Cell) -> tuple[float, ...]:
    """How clearly each edge of a rectangle shows, 0..1: left, right, top, bottom."""
    values = []
    for axis, position in ((0, cell.left), (0, cell.right), (1, cell.top), (1, cell.bottom)):
        evidence = run.vertical if axis == 0 else run.horizontal
        across = (cell.top, cell.bottom) if axis == 0 else (cell.left, cell.right)
        first = int(across[0] // evidence.block)
        last = max(first + 1, int(np.ceil(across[1] / evidence.block)))
        at = min(max(round(position), 1), evidence.score.shape[1] - 2)
        values.append(float(np.clip(evidence.score[first:last, at - 1 : at + 2].max(axis=1).mean() / 4, 0, 1)))
    return tuple(values)


def _worth(run: Run, cell: Cell, unit: Category) -> float:
    params = tuned(Params)
    cell_m = run.grid.cell_m
    off = np.array([unit.width.deviation(cell.width * cell_m), unit.height.deviation(cell.height * cell_m)])
    usual = float(np.exp(-0.5 * (off @ off)))
    return float(np.mean(line_clarity(run, cell))) + params.usual_worth * usual + params.row_worth * _in_row(run, cell)


def _in_row(run: Run, cell: Cell) -> int:
    """How many of a rectangle's upper and lower edges a front beside it shares: units are made to fit a row of cupboards."""
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


def _seam(run: Run, cell: Cell) -> float | None:
    """The row of the clearest line that shows on both sides of the handles; None when none stands out."""
    params = tuned(Params)
    profile = _beside_handles(run, cell)
    smallest = round(params.lowest_drawer_m / run.grid.cell_m)
    if len(profile) <= 2 * smallest:
        return None
    middle = float(np.median(profile))
    spread = 1.4826 * float(np.median(np.abs(profile - middle))) + 0.03
    inner = profile[smallest:-smallest]
    at = int(np.argmax(inner))
    if inner[at] < max(params.least_z, middle + params.prominent * spread):
        return None
    return round(cell.top) + smallest + at + 0.5


def _beside_handles(run: Run, cell: Cell) -> np.ndarray:
    """At each row of a panel, how surely a line runs through both its left and its right third."""
    params = tuned(Params)
    evidence = run.horizontal
    first, last = round(cell.left / evidence.block), round(cell.right / evidence.block)
    rows = slice(round(cell.top), round(cell.bottom))
    third = max((last - first) // 3, 1)
    sides = []
    for blocks in (slice(first, first + third), slice(last - third, last)):
        score = np.where(evidence.known[blocks, rows], evidence.score[blocks, rows], 0.0)
        if not score.size:
            return np.zeros(0)
        sides.append(np.quantile(score, params.drawn_share, axis=0))
    return np.asarray(np.minimum(*sides))
