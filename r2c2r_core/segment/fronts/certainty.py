"""How likely a front's edges are where they were found: a logistic model on what its run shows of them."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.calibration import probability
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.runs.contrast import SIDES, edge_changes, edges_of
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.segment.runs.xy_cut import LineField, across
from r2c2r_core.tuning import param, tuned

_FITTED = "fitted on 34 development kitchens of five makers: benchmarks/front_certainty.py"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What is looked at, and what it says for an edge."""

    faintest: float = param(0.1, "share", "of an edge, where it is the least likely one")
    nearest_m: float = param(0.012, "m", "inside an edge, from where another line is a rival", gt=0)
    farthest_m: float = param(0.045, "m", "inside an edge, up to where it is", gt=0, source="frames are 2-5 cm wide")
    faint: float = param(0.41, "ratio", "of log-odds, to those of its faintest part", source=_FITTED)
    contrast: float = param(0.42, "ratio", "to the logarithm of how far colours change at it", source=_FITTED)
    rival: float = param(-0.48, "ratio", "to the log-odds of the likeliest line inside it, where that is one", source=_FITTED)
    front: float = param(1.31, "ratio", "to the mean log-odds of being on a front", source=_FITTED)
    offset: float = param(-3.52, "log", "that log-odds are worth more", source=_FITTED)


def edges_right(run: Run, cell: Cell) -> float:
    """The probability that all edges of a rectangle are within 10 mm of a front's."""
    return float(np.prod([probability(float(odds)) for odds in evidence(run, cell) @ _weights()]))


def evidence(run: Run, cell: Cell) -> np.ndarray:
    """What is seen of each edge, left, right, upper and lower: (4, 5), in the order of the model's numbers, the last one 1."""
    params, field, rows = tuned(Params), LineField(run.odds, run.grid.cell_m), []
    on_front = _mean_odds(run, cell)
    changes = edge_changes(run.mosaic, cell)
    for (axis, end), at, change in zip(SIDES, edges_of(cell), changes, strict=True):
        faintest = float(np.quantile(run.odds.along(axis, at, *across(cell, 1 - axis)), params.faintest))
        inwards = (-1 if end else 1) / run.grid.cell_m
        near, far = sorted((at + inwards * params.nearest_m, at + inwards * params.farthest_m))
        rival = field.likeliest(cell, axis, max(near, 0.0), max(far, 0.0))
        rows.append([faintest, np.log(max(change, 1.0)), max(rival[1], 0.0) if rival is not None else 0.0, on_front, 1.0])
    return np.array(rows)


def _weights() -> np.ndarray:
    params = tuned(Params)
    return np.array([params.faint, params.contrast, params.rival, params.front, params.offset])


def _mean_odds(run: Run, cell: Cell) -> float:
    """Of being on a front, over a rectangle."""
    (left, right), (top, bottom) = ((max(round(end / STEP), 0) for end in across(cell, axis)) for axis in (0, 1))
    odds = run.odds.front[top : max(bottom, top + 1), left : max(right, left + 1)]
    return float(odds.mean()) if odds.size else 0.0
