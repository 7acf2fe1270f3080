"""Log-odds of fronts' edges from the seam network, from lines that frames agree on, and from ends of the plane in depth."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.mosaics.lines import Evidence
from r2c2r_core.segment.mosaics.orthomosaic import STEP
from r2c2r_core.segment.mosaics.panel_net import SUREST, PanelOdds, panel_odds
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.tuning import param, tuned

_BESIDE = 3  # distance from a seam to a front, in cells of the odds
_SOURCE = "chosen on development kitchens of both generators"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of lines and ends added to the network's odds."""

    line_weight: float = param(
        0.7, "log", "Log-odds per σ that a line adds where the network considers an edge possible", source=_SOURCE
    )
    line_from: float = param(1.0, "σ", "Minimum z-score of a line for it to add log-odds", source=_SOURCE)
    line_most: float = param(4.0, "σ", "Maximum excess over that z-score that counts", source=_SOURCE)
    possible: float = param(
        -3.5, "log", "Network log-odds below which no edge is possible and a line is a front's profile", source=_SOURCE
    )
    dark: float = param(110.0, "grey", "Maximum lightness of a front that is dark: gaps beside it may be lighter than it", gt=0)
    block_m: float = param(0.03, "m", "Length along a line over which depth is pooled", gt=0)
    end_off_m: float = param(
        0.01,
        "m",
        "Standard deviation of how far surface adjoining a front continues in its plane",
        gt=0,
        source="1-2 of a phone's 256 columns: 1-3 cm at 2 m",
    )
    lost_m: float = param(
        0.02,
        "m",
        "Standard deviation of how far depth falls short of an end: sensors drop pixels beside a step",
        gt=0,
        source="fronts of development kitchens end 15-30 mm beyond their depth",
    )
    seen: float = param(
        0.3,
        "share",
        "Minimum density of depth points, relative to the usual one, for depth to show what lies beyond an end",
        gt=0,
        source=_SOURCE,
    )
    straight_m: float = param(0.1, "m", "Length along an end over which the network's odds are averaged", gt=0, source=_SOURCE)
    end_from: float = param(2.0, "σ", "z-score, of at most 6, above which depth shows an end")


def edge_odds(odds: PanelOdds, mosaic: Image, relief: Relief, vertical: Evidence, horizontal: Evidence) -> PanelOdds:
    """Log-odds from the network, the plane's relief, and the evidence of vertical and horizontal lines."""
    rows, columns = odds.front.shape
    seen = mosaic[: rows * STEP, : columns * STEP].any(axis=2).reshape(rows, STEP, columns, STEP).any(axis=(1, 3))
    return replace(
        odds,
        front=np.where(seen, odds.front, 0.0).astype(np.float32),  # what no frame shows is as likely front as not
        upright=_with_ends(_with_lines(odds.upright, vertical), relief, 0),
        level=np.ascontiguousarray(_with_ends(_with_lines(odds.level.T, horizontal), relief, 1).T),
    )


def seam_odds(mosaic: Image, relief: Relief) -> PanelOdds:
    """Network log-odds; between dark fronts also of the negative image, in which seams lighter than the fronts look usual.

    A lit carcass shows between dark fronts, whereas the network's training data have dark gaps.
    """
    odds = panel_odds(mosaic, relief.count, relief.raised, relief.level_m)
    rows, columns = odds.front.shape
    lab = cv2.cvtColor(mosaic[: rows * STEP, : columns * STEP], cv2.COLOR_RGB2LAB)
    light = lab[..., 0].reshape(rows, STEP, columns, STEP).mean(axis=(1, 3))
    dark = (odds.front > 0) & (light < tuned(Params).dark)
    if not dark.any():
        return odds
    lab[..., 0] = 255 - lab[..., 0]
    negative = panel_odds(cv2.cvtColor(lab, cv2.COLOR_LAB2RGB), relief.count, relief.raised, relief.level_m)
    upright = np.where(_lit(light, dark, 1), np.maximum(odds.upright, negative.upright), odds.upright)
    level = np.where(_lit(light, dark, 0), np.maximum(odds.level, negative.level), odds.level)
    return replace(odds, upright=upright, level=level)


def _lit(light: np.ndarray, dark: np.ndarray, axis: int) -> np.ndarray:
    """Mask of the cells (or neighbours) lighter than the dark fronts on both sides, along an axis of the array."""
    before, after = (np.roll(light, off, axis=axis) for off in (_BESIDE, -_BESIDE))
    between = np.roll(dark, _BESIDE, axis=axis) & np.roll(dark, -_BESIDE, axis=axis)
    ridge = between & (light > np.maximum(before, after))
    return np.asarray(cv2.dilate(ridge.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0)


def _with_ends(odds: np.ndarray, relief: Relief, axis: int) -> np.ndarray:
    """Log-odds of edges (lines, positions), raised to the depth evidence where depth shows that the plane ends.

    Adjoining surface may continue in the plane a little, and depth may fall short of the end where it shows nothing beyond: the
    edge lies near the end where the network's odds are highest, and nowhere else in that range. Where the network rules an edge
    out, a step back is the border of a deep panel in its frame, and an enclosed hole is glass.
    """
    params, known = tuned(Params), odds.copy()
    block, (lines, positions) = round(params.block_m / relief.cell_m) * STEP, odds.shape
    across = (positions, lines) if axis == 0 else (lines, positions)
    edges = relief.edge_evidence(axis, block, across[0] * STEP, across[1] * STEP)
    near = _NearEnds(odds, relief, axis)
    for scores, least in ((edges.ends, -np.inf), (edges.within, params.possible)):
        shown = scores.reshape(len(scores), positions, STEP).max(axis=2)
        shown = shown[np.minimum(np.arange(lines) * STEP // block, len(scores) - 1)]
        line, end = np.nonzero(shown > params.end_from)
        at, worth = near.positions(line, end), near.worth(line, end)
        best = worth.argmax(axis=1)
        mark, short = np.nonzero(near.short_of(best))
        np.minimum.at(known, (line[mark], at[mark, short]), worth[mark, short] - worth[mark, best[mark]])
        edge = at[np.arange(len(at)), best]
        value = np.minimum(shown[line, end] - params.end_from, SUREST).astype(known.dtype)
        held = odds[line, edge] > least
        np.maximum.at(known, (line[held], edge[held]), value[held])
    return known


class _NearEnds:
    """Scores of an edge at offsets from where depth shows an end; negative offsets lie beyond it."""

    def __init__(self, odds: np.ndarray, relief: Relief, axis: int) -> None:
        params = tuned(Params)
        reach = round(3 * params.end_off_m / relief.cell_m)
        self._off = np.arange(-round(2 * params.lost_m / relief.cell_m), reach + 1)
        self._cost = 0.5 * (self._off * relief.cell_m / np.where(self._off < 0, params.lost_m, params.end_off_m)) ** 2
        self._inwards, self._seen = _inwards(relief, axis, reach), params.seen
        self._pooled, self._density = _along(odds, relief), _density(relief, axis)

    def positions(self, line: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Positions of the candidate edges (ends, offsets)."""
        return self._at(line, end, self._off)

    def worth(self, line: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Log-odds minus the cost of the offset (ends, offsets); -inf beyond where depth shows the surface that follows."""
        outer = self._at(line, end, np.minimum(self._off, -_BESIDE))
        beyond = np.where(self._off < 0, self._density[line[:, None], outer], 0)
        beyond = np.maximum.accumulate(beyond[:, ::-1], axis=1)[:, ::-1]
        return np.where(beyond > self._seen, -np.inf, self._pooled[line[:, None], self.positions(line, end)] - self._cost)

    def short_of(self, best: np.ndarray) -> np.ndarray:
        """Mask of the offsets between an end's edge, given by its index, and the end of depth: no other edge is there."""
        return (self._off > self._off[best][:, None] + 1) & (self._off <= 1)

    def _at(self, line: np.ndarray, end: np.ndarray, off: np.ndarray) -> np.ndarray:
        return np.clip(end[:, None] + off * self._inwards[line, end][:, None], 0, self._pooled.shape[1] - 1)


def _along(odds: np.ndarray, relief: Relief) -> np.ndarray:
    """Means along lines, over about the length on which an end is straight."""
    return np.asarray(cv2.blur(odds, (1, 2 * round(tuned(Params).straight_m / relief.cell_m / 2) + 1)))


def _density(relief: Relief, axis: int) -> np.ndarray:
    """Density of depth points on or before the plane, averaged along lines (lines, positions), relative to the usual one."""
    points = (relief.count if axis == 0 else relief.count.T).astype(np.float32)
    return _along(points, relief) / (float(np.median(points[points > 0])) if points.any() else 1.0)


def _inwards(relief: Relief, axis: int, reach: int) -> np.ndarray:
    """Side (1 or -1) of each position (lines, positions) on which depth shows more of the plane."""
    points = relief.count * (1 - relief.raised)
    sums = np.pad(points if axis == 0 else points.T, ((0, 0), (reach, reach))).cumsum(axis=1)
    middle = sums[:, reach:-reach]
    after, before = sums[:, 2 * reach :] - middle, middle - sums[:, : -2 * reach]
    return np.where(after >= before, 1, -1)


def _with_lines(odds: np.ndarray, evidence: Evidence) -> np.ndarray:
    """Log-odds of edges (lines, positions) plus line evidence where the network considers an edge possible."""
    params, (lines, positions) = tuned(Params), odds.shape
    score = evidence.score[:, : positions * STEP]
    score = np.pad(score, ((0, 0), (0, positions * STEP - score.shape[1])))
    score = score.reshape(len(score), positions, STEP).max(axis=2)
    score = score[np.minimum(np.arange(lines) * STEP // evidence.block, len(score) - 1)]
    added = odds + params.line_weight * np.clip(score - params.line_from, 0, params.line_most)
    return np.where(odds > params.possible, np.clip(added, -SUREST, SUREST), odds).astype(np.float32)
