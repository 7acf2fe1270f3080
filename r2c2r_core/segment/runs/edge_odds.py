"""Log-odds of fronts' edges: what the seam network sees, the lines that frames agree on, and where depth shows an end."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.runs.lines import Evidence
from r2c2r_core.segment.runs.orthomosaic import STEP
from r2c2r_core.segment.runs.panel_net import SUREST, PanelOdds, panel_odds
from r2c2r_core.segment.runs.relief import Relief
from r2c2r_core.tuning import param, tuned

_SOURCE = "chosen on development kitchens of both generators"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What lines and ends add to the network's odds."""

    line_weight: float = param(0.7, "log", "a σ that a line adds where the network holds an edge possible", source=_SOURCE)
    line_from: float = param(1.0, "σ", "from where a line adds", source=_SOURCE)
    line_most: float = param(4.0, "σ", "beyond that, of which more adds nothing", source=_SOURCE)
    possible: float = param(-3.5, "log", "of an edge by the network, below which a line is a front's profile", source=_SOURCE)
    block_m: float = param(0.03, "m", "along a line, over which depth is pooled", gt=0)
    end_off_m: float = param(
        0.01,
        "m",
        "by which what adjoins a front goes on in its plane",
        gt=0,
        source="1-2 of a phone's 256 columns: 1-3 cm at 2 m",
    )
    end_from: float = param(2.0, "σ", "of 6, from where depth shows an end")


def edge_odds(mosaic: Image, relief: Relief, vertical: Evidence, horizontal: Evidence) -> PanelOdds:
    """Of a mosaic (rows, columns, 3), the relief of the same plane and the evidence of its lines."""
    odds = panel_odds(mosaic, relief.count, relief.raised, relief.level_m)
    rows, columns = odds.front.shape
    seen = mosaic[: rows * STEP, : columns * STEP].any(axis=2).reshape(rows, STEP, columns, STEP).any(axis=(1, 3))
    return replace(
        odds,
        front=np.where(seen, odds.front, -SUREST).astype(np.float32),  # or what nobody saw would speak against lines through it
        upright=_with_lines(_with_ends(odds.upright, relief, 0), vertical),
        level=np.ascontiguousarray(_with_lines(_with_ends(odds.level.T, relief, 1), horizontal).T),
    )


def _with_ends(odds: np.ndarray, relief: Relief, axis: int) -> np.ndarray:
    """Log-odds of edges (lines, positions), not below what depth says where it shows that the plane ends.

    What adjoins may go on in the plane for a little: the edge is there or within, where the network thinks it likeliest.
    """
    params = tuned(Params)
    block, (lines, positions) = round(params.block_m / relief.cell_m) * STEP, odds.shape
    across = (positions, lines) if axis == 0 else (lines, positions)
    ends = relief.edge_evidence(axis, block, across[0] * STEP, across[1] * STEP)
    shown = ends.reshape(len(ends), positions, STEP).max(axis=2)
    shown = shown[np.minimum(np.arange(lines) * STEP // block, len(ends) - 1)]
    line, end = np.nonzero(shown > params.end_from)
    reach = round(3 * params.end_off_m / relief.cell_m)
    off = np.arange(reach + 1)
    near = np.clip(end[:, None] + off * _inwards(relief, axis, reach)[line, end][:, None], 0, positions - 1)
    worth = odds[line[:, None], near] - 0.5 * (off * relief.cell_m / params.end_off_m) ** 2
    at = near[np.arange(len(near)), worth.argmax(axis=1)]
    known = odds.copy()
    np.maximum.at(known, (line, at), np.minimum(shown[line, end] - params.end_from, SUREST).astype(known.dtype))
    return known


def _inwards(relief: Relief, axis: int, reach: int) -> np.ndarray:
    """On which side (1 or -1) of each position (lines, positions) depth saw more of the plane."""
    points = relief.count * (1 - relief.raised)
    sums = np.pad(points if axis == 0 else points.T, ((0, 0), (reach, reach))).cumsum(axis=1)
    middle = sums[:, reach:-reach]
    after, before = sums[:, 2 * reach :] - middle, middle - sums[:, : -2 * reach]
    return np.where(after >= before, 1, -1)


def _with_lines(odds: np.ndarray, evidence: Evidence) -> np.ndarray:
    """Log-odds of edges (lines, positions) with what lines say where the network holds an edge possible."""
    params, (lines, positions) = tuned(Params), odds.shape
    score = evidence.score[:, : positions * STEP]
    score = np.pad(score, ((0, 0), (0, positions * STEP - score.shape[1])))
    score = score.reshape(len(score), positions, STEP).max(axis=2)
    score = score[np.minimum(np.arange(lines) * STEP // evidence.block, len(score) - 1)]
    added = odds + params.line_weight * np.clip(score - params.line_from, 0, params.line_most)
    return np.where(odds > params.possible, np.clip(added, -SUREST, SUREST), odds).astype(np.float32)
