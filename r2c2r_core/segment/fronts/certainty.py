"""Logistic model of the probability that a front's edges are where they were found, from the evidence on its run."""

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
    """Tuned parameters (features and weights) of the logistic model."""

    faintest: float = param(0.1, "share", "Quantile of the log-odds along an edge that stands for its faintest part")
    nearest_m: float = param(0.012, "m", "Minimum distance inside an edge of a rival line", gt=0)
    farthest_m: float = param(
        0.045, "m", "Maximum distance inside an edge of a rival line", gt=0, source="frames are 2-5 cm wide"
    )
    faint: float = param(0.41, "ratio", "Weight of the log-odds of the edge's faintest part", source=_FITTED)
    contrast: float = param(0.42, "ratio", "Weight of the logarithm of the colour change at the edge", source=_FITTED)
    rival: float = param(
        -0.48, "ratio", "Weight of the log-odds of the likeliest line inside the edge, where positive", source=_FITTED
    )
    front: float = param(1.31, "ratio", "Weight of the mean log-odds of being on a front", source=_FITTED)
    offset: float = param(-3.52, "log", "Constant term of the log-odds", source=_FITTED)


def edges_right(run: Run, cell: Cell) -> float:
    """Probability that all edges of a rectangle are within 10 mm of a front's."""
    return float(np.prod([probability(float(odds)) for odds in evidence(run, cell) @ _weights()]))


def evidence(run: Run, cell: Cell) -> np.ndarray:
    """Features of each edge (left, right, upper, lower): (4, 5), in the order of the model's weights; the last one is 1."""
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
    """Mean log-odds of being on a front, over a rectangle."""
    (left, right), (top, bottom) = ((max(round(end / STEP), 0) for end in across(cell, axis)) for axis in (0, 1))
    odds = run.odds.front[top : max(bottom, top + 1), left : max(right, left + 1)]
    return float(odds.mean()) if odds.size else 0.0
