"""Upper ends of fronts that lie beyond the border of all pictures."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.kitchen.category import Category
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of unseen upper ends."""

    row_m: float = param(
        0.02, "m", "Maximum misalignment of the fronts of a row", gt=0, source="poses bend a real kitchen's lines by 2 cm"
    )
    beyond_m: float = param(
        0.01, "m", "Height over an edge that frames must show for the edge to be seen", gt=0, source="two cells of the odds"
    )


def with_unseen_top(panel: Cell, run: Run, kind: Category | None) -> Cell:
    """Panel whose upper end no frame shows, extended to the upper edge of its row, else to the usual height of its category."""
    if _shows_top(panel, run):
        return panel
    slack, shown = tuned(Params).row_m / run.grid.cell_m, _shown_from(panel, run)
    row = [
        other
        for other in run.cells
        if abs(other.bottom - panel.bottom) < slack and other.top < shown + slack and _shows_top(other, run)
    ]
    if row:
        return replace(panel, top=min(row, key=lambda other: abs(other.left - panel.left)).top)
    usual = kind.height.usual / run.grid.cell_m if kind is not None else 0.0
    return replace(panel, top=min(shown, panel.bottom - usual))


def _shows_top(panel: Cell, run: Run) -> bool:
    """Whether frames show what is over a panel's upper edge."""
    return _shown_from(panel, run) <= panel.top - tuned(Params).beyond_m / run.grid.cell_m


def _shown_from(panel: Cell, run: Run) -> float:
    """Row from which on, downwards, frames show most of a panel's width."""
    columns = run.mosaic[: max(round(panel.bottom), 1), max(round(panel.left), 0) : round(panel.right)].any(axis=2)
    return float(np.argmax(2 * columns.sum(axis=1) > columns.shape[1]))
