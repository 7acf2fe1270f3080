"""Candidate lines between fronts: positions where an edge is likely somewhere, followed across the grid by Viterbi paths."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.tuning import param, tuned

CROSSING = -1e3  # log-odds of a line that crosses a likelier one
MOST_LINES = 40  # along an axis: a run of 8 m has 20 seams


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of candidate lines. Odds are natural logarithms: 0 is even."""

    apart_m: float = param(0.0125, "m", "Minimum distance between two lines: a gap has one", gt=0)
    block_m: float = param(0.03, "m", "Length along a line over which its odds are pooled and its position is constant", gt=0)
    hidden: float = param(0.07, "share", "Fraction of an edge that handles and occluders hide", gt=0, lt=1)
    most_odds: float = param(
        1.0, "log", "Maximum log-odds of a block: a handle's edge is a line as clear, along part of a front", gt=0
    )
    step: float = param(1.0, "log", "Cost of a one-cell sidestep of a line between blocks: poses and lenses bend lines")
    bend_m: float = param(
        0.03,
        "m",
        "Maximum deviation of a line from its position where it is likeliest: beyond, it is another stack's seam",
        gt=0,
        source="a real kitchen's poses bend its lines by more than 2 cm",
    )


class LineSet(NamedTuple):
    """Lines across a grid, in cells of the odds. `ends` also has both borders of the grid."""

    ends: np.ndarray  # (lines + 2,) positions, ascending
    starts: np.ndarray  # (blocks + 1,) borders of blocks along the lines
    paths: np.ndarray  # (lines, blocks) positions
    counted: np.ndarray  # (lines, blocks) log-likelihood ratio of an edge that may be hidden; 0 where no front is beside it
    field: np.ndarray  # (blocks, positions) log-odds everywhere

    def sums(self, ends: np.ndarray) -> np.ndarray:
        """Log-likelihood ratio of each line, times cells, between any two positions along it: (lines, from, to)."""
        upto = np.pad(np.cumsum(self.counted * np.diff(self.starts), axis=1), ((0, 0), (1, 0)))
        upto = np.array([np.interp(ends, self.starts, each) for each in upto]).reshape(-1, len(ends))
        return upto[:, None, :] - upto[:, :, None]

    def position(self, line: int, low: float, high: float) -> float:
        """Mean position of a line between two positions along it, with subcell accuracy: weighted by the odds around it."""
        first = min(int(np.searchsorted(self.starts, low, side="right")) - 1, len(self.starts) - 2)
        blocks = np.arange(max(first, 0), max(int(np.searchsorted(self.starts, high)), first + 1))
        beside = self.counted[line, blocks] != 0
        blocks = blocks[beside] if beside.any() else blocks
        path, near = self.paths[line, blocks], np.arange(-2, 3)
        columns = np.clip(path[:, None] + near, 0, self.field.shape[1] - 1)
        weights = np.exp(self.field[blocks[:, None], columns].mean(axis=0))
        return float(path.mean() + 0.5 + near @ weights / weights.sum())


def find_lines(odds: np.ndarray, beside: np.ndarray, cell_m: float, *, every: bool) -> LineSet:
    """Candidate lines of log-odds (lines, positions), weighted by the probability that a front is `beside` them.

    `every` line that is likelier than its surroundings, or only those that are likely somewhere.
    """
    params = tuned(Params)
    count = max(1, round(len(odds) * cell_m / params.block_m))
    starts = np.append(np.arange(count) * len(odds) // count, len(odds))
    field, weights = _pooled(odds, starts), _pooled(beside, starts)
    shown = (1 - params.hidden) * np.exp(np.minimum(field, params.most_odds))
    counted = weights * np.log(shown + params.hidden)  # an edge, unless something hides it here
    found = _paths(counted, weights * np.log(params.hidden), cell_m, -np.inf if every else 0.0)
    paths = np.array(sorted(found, key=np.mean), np.int64).reshape(-1, count)
    inner = np.maximum.accumulate(paths.mean(axis=1)) + 0.5 + 1e-6 * np.arange(len(paths))  # strictly ascending
    blocks = np.arange(count)
    ends = np.concatenate([[0.0], inner, [odds.shape[1]]])
    return LineSet(ends, starts, paths, counted[blocks, paths], field)


def _pooled(values: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Means over blocks of rows."""
    return np.asarray(np.add.reduceat(values, starts[:-1], axis=0) / np.diff(starts)[:, None])


def _paths(counted: np.ndarray, absent: np.ndarray, cell_m: float, least: float) -> list[np.ndarray]:
    """Path (blocks,) of each line from the block where it is likeliest; no path crosses another or shares its evidence."""
    params, free, found = tuned(Params), counted.copy(), list[np.ndarray]()
    apart, bend, at = round(params.apart_m / cell_m), round(params.bend_m / cell_m), np.arange(counted.shape[1])
    for position in _peaks(counted, apart):
        block = int(counted[:, position].argmax())
        if len(found) < MOST_LINES and free[block, position] > least:
            own = np.all([(at > path[:, None]) == (position > path[block]) for path in found], axis=0)
            path = _path(np.where(own, free, CROSSING), position, block, bend)
            near = np.clip(path[:, None] + np.arange(-apart, apart + 1), 0, len(at) - 1)
            np.put_along_axis(free, near, np.take_along_axis(absent, near, axis=1), axis=1)
            found.append(path)
    return found


def _peaks(counted: np.ndarray, apart: int) -> np.ndarray:
    """Positions that are likelier in some block than those around them in any, in order of their sum over all blocks."""
    best = counted.max(axis=0).astype(np.float32)
    peak = (best >= cv2.dilate(best[None], np.ones((1, 2 * apart + 1), np.uint8))[0]) & (counted != 0).any(axis=0)
    peak[:apart] = peak[len(peak) - apart :] = False
    at = np.flatnonzero(peak & ~np.pad(peak, (1, 0))[:-1])  # the first of equal neighbours
    return np.asarray(at[np.argsort(-counted.sum(axis=0)[at], kind="stable")])


def _path(counted: np.ndarray, position: int, block: int, bend: int) -> np.ndarray:
    """Viterbi path (blocks,) through a position in a block, at most `bend` cells off it."""
    step, low = tuned(Params).step, max(position - bend, 0)
    worth, path = counted[:, low : position + bend + 1], np.full(len(counted), position)
    for others in (range(block + 1, len(counted)), range(block - 1, -1, -1)):
        score, came = np.full(worth.shape[1], -np.inf), []
        score[position - low] = 0.0
        for other in others:
            beyond = np.pad(score, 1, constant_values=-np.inf)
            ways = np.stack([score, beyond[:-2] - step, beyond[2:] - step])
            chosen = ways.argmax(axis=0)
            came.append(np.array([0, -1, 1])[chosen])
            score = ways.max(axis=0) + worth[other]
        at = int(score.argmax())
        for other, moves in zip(reversed(others), reversed(came), strict=True):
            path[other] = low + at
            at += int(moves[at])
    return path
