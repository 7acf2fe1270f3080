"""Most probable guillotine partition of a furniture run into fronts, by dynamic programming over candidate lines.

The log-likelihood of a partition is the sum over its lines (log-odds of an edge along each, weighted by the probability of a
front beside it) and over its rectangles (log-odds of a front or of anything else inside, with a prior of fronts' sizes and
handles). Every rectangle between candidate lines is solved once, from small to large, so that the best partition is exact. A
guillotine partition is one that straight cuts from border to border can make.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.runs.candidate_lines import LineSet, find_lines
from r2c2r_core.tuning import param, tuned

END_CELLS = 2  # 1 cm: the network's odds of a front change over 1 to 2 cm


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the partition. Odds are natural logarithms: 0 is even."""

    beside_m: float = param(0.02, "m", "Maximum distance from a line to a front for the line to be its edge", gt=0)
    end_weight: float = param(
        0.5, "ratio", "Weight of the odds that a front ends at a line: the network's odds of edges have them in part", ge=0
    )
    sample_m: float = param(
        0.08, "m", "Length of a line, and side of a square, whose odds count as one independent sample", gt=0
    )
    usual_width_m: float = param(0.5, "m", "Median width of a front", gt=0, source="units sold are 0.3 to 0.6 m wide")
    usual_height_m: float = param(
        0.45, "m", "Median height of a front", gt=0, source="drawers 0.14 m, doors 0.72 m, tall doors 2 m"
    )
    width_spread: float = param(0.5, "log", "Standard deviation of the logarithm of fronts' widths", gt=0)
    height_spread: float = param(0.9, "log", "Standard deviation of the logarithm of fronts' heights", gt=0)
    odd_share: float = param(0.03, "share", "Fraction of fronts of any size: fillers, end panels, wide fronts", gt=0, lt=1)
    handled_m: tuple[float, float] = param(
        (0.12, 0.07), "m", "Minimum width and height of a front with a handle", source="units from 0.15 m, drawers from 0.08 m"
    )
    other_share: float = param(
        0.1, "share", "Fraction of rectangles beside fronts that are none: gaps, rails, plinths", gt=0, lt=1
    )
    no_handle: float = param(0.5, "share", "Fraction of fronts without a handle", gt=0, lt=1)
    next_handle: float = param(0.02, "ratio", "Fraction of fronts with each further handle, relative to one fewer", gt=0, lt=1)


class Clicks(NamedTuple):
    """Clicks on a region, by object: (n, 2) grid cells each."""

    objects: Sequence[np.ndarray]
    shared_cost: float  # of two objects on one front, as log-odds


class Partitioner:
    """Log-likelihoods of lines and fronts on a run's grid."""

    def __init__(self, odds: PanelOdds, cell_m: float) -> None:
        self._params, self._cell_m = (params := tuned(Params)), cell_m * STEP
        self._odds, front = odds, odds.front
        self._edges = odds.upright + _ends(front, 1), odds.level + _ends(front, 0)
        reach = 2 * round(params.beside_m / self._cell_m) + 1
        shown = cv2.erode((front != 0).astype(np.float32), np.ones((3, 3), np.uint8))  # an edge shows only with both sides
        self._beside = tuple(
            shown / (1 + np.exp(-cv2.dilate(front, np.ones(size, np.uint8)))) for size in ((1, reach), (reach, 1))
        )
        self._handles = cv2.connectedComponentsWithStats((odds.handle > 0).astype(np.uint8))[3][1:]

    def divide(self, region: Cell, clicks: Clicks | None = None) -> list[Cell]:
        """Rectangles that tile a region of the grid.

        With `clicks`, only rectangles on which several objects were clicked are cut, between the clicks.
        """
        upright, level = (self._lines(region, axis, every=clicks is not None) for axis in (0, 1))
        if upright is None or level is None:
            return [region]
        cut, (rows, columns) = self._first_cuts(region, upright, level, clicks), self._area(region)
        found, waiting = list[Cell](), [(0, len(upright.ends) - 1, 0, len(level.ends) - 1)]
        while waiting:
            left, right, top, bottom = waiting.pop()
            at = int(cut[left, right, top, bottom])
            if at > 0:
                waiting += [(left, at, top, bottom), (at, right, top, bottom)]
            elif at < 0:
                waiting += [(left, right, top, -at), (left, right, -at, bottom)]
            else:
                along, across = (level.ends[top], level.ends[bottom]), (upright.ends[left], upright.ends[right])
                found.append(
                    Cell(
                        _edge(upright, left, *along, columns.start, region.left),
                        _edge(level, top, *across, rows.start, region.top),
                        _edge(upright, right, *along, columns.start, region.right),
                        _edge(level, bottom, *across, rows.start, region.bottom),
                    )
                )
        return found

    def seam_gain(self, region: Cell, inset_m: float) -> float:
        """Log-likelihood ratio of the best division of a region to the region undivided; -inf where nothing divides it.

        It is cut at least `inset_m` within its borders.
        """
        upright, level = (self._lines(region, axis, every=True) for axis in (0, 1))
        if upright is None or level is None:
            return -np.inf
        worth, uprights, levels = self._evidence(region, upright, level)
        _, value = _best_cuts(worth, uprights, levels, np.ones(worth.shape, bool))
        x, y = (np.flatnonzero(_inside(each.ends * self._cell_m, inset_m)) for each in (upright, level))
        parts = [value[0, x, 0, -1] + value[x, -1, 0, -1] + uprights[x - 1, 0, -1]]
        parts += [value[0, -1, 0, y] + value[0, -1, y, -1] + levels[y - 1, 0, -1]]
        return float(np.concatenate(parts).max(initial=-np.inf) - worth[0, -1, 0, -1])

    def _lines(self, region: Cell, axis: int, *, every: bool) -> LineSet | None:
        """Candidate lines across a region: `every` one, or those that are likely somewhere; None in a region without extent."""
        rows, columns = self._area(region)
        odds, beside = self._edges[axis][rows, columns], self._beside[axis][rows, columns]
        if min(odds.shape) < 2:
            return None
        return find_lines(odds if axis == 0 else odds.T, beside if axis == 0 else beside.T, self._cell_m, every=every)

    def _area(self, region: Cell) -> tuple[slice, slice]:
        """Rows and columns of the odds."""
        height, width = self._odds.front.shape
        top, left = max(round(region.top / STEP), 0), max(round(region.left / STEP), 0)
        return slice(top, min(round(region.bottom / STEP), height)), slice(left, min(round(region.right / STEP), width))

    def _first_cuts(self, region: Cell, upright: LineSet, level: LineSet, clicks: Clicks | None) -> np.ndarray:
        """First line of the best partition of each rectangle: 0 none, positive upright, negative level."""
        value, uprights, levels = self._evidence(region, upright, level)
        several = np.ones(value.shape, bool)
        if clicks is not None:
            rows, columns = self._area(region)
            each = [on / STEP - [columns.start, rows.start] for on in clicks.objects]
            count = np.sum([_counts(upright.ends, level.ends, on) > 0 for on in each], axis=0)
            several = count > 1
            value[several] -= clicks.shared_cost * (count[several] - 1)
            value[count == 0] = -np.inf
            for on in each:
                uprights[_separates(upright.ends, level.ends, on)] = -np.inf
                levels[_separates(level.ends, upright.ends, on[:, ::-1])] = -np.inf
        return _best_cuts(value, uprights, levels, several)[0]

    def _evidence(self, region: Cell, upright: LineSet, level: LineSet) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Log-likelihoods of rectangles, and of upright (line, top, bottom) and level (line, left, right) lines."""
        samples = self._params.sample_m / self._cell_m
        return self._worth(region, upright, level), upright.sums(level.ends) / samples, level.sums(upright.ends) / samples

    def _worth(self, region: Cell, upright: LineSet, level: LineSet) -> np.ndarray:
        """Log-likelihood of each rectangle between lines as one front, or as anything else if that is more."""
        params, area = self._params, self._area(region)
        x, y = upright.ends, level.ends
        sums = np.pad(np.cumsum(np.cumsum(self._odds.front[area], axis=0), axis=1), ((1, 0), (1, 0)))
        inside = _boxes(sums[np.ix_(np.round(y).astype(int), np.round(x).astype(int))])
        front = inside * (self._cell_m / params.sample_m) ** 2
        handles = _counts(x, y, self._handles - [area[1].start, area[0].start])
        width, height = (np.maximum(ends[None] - ends[:, None], 0.5) * self._cell_m for ends in (x, y))
        sizes = self._log_density(width[:, :, None, None], 0, handles) + self._log_density(height, 1, handles)
        return np.asarray(np.maximum(front + sizes + self._log_share(handles), np.log(params.other_share) - front))

    def _log_share(self, count: np.ndarray) -> np.ndarray:
        """Log of the fraction of fronts with `count` handles."""
        none, following = self._params.no_handle, self._params.next_handle
        return np.where(count == 0, np.log(none), np.log((1 - none) * (1 - following)) + np.log(following) * (count - 1))

    def _log_density(self, size_m: np.ndarray, axis: int, handles: np.ndarray) -> np.ndarray:
        """Log-density of the logarithm of a front's size, by its number of handles: fillers and end panels have none."""
        params = self._params
        usual, spread = (
            (params.usual_width_m, params.width_spread) if axis == 0 else (params.usual_height_m, params.height_spread)
        )
        normal = np.exp(-0.5 * (np.log(size_m / usual) / spread) ** 2) / (spread * np.sqrt(2 * np.pi))
        possible = (handles == 0) | (size_m >= params.handled_m[axis])
        return np.log(np.where(possible, (1 - params.odd_share) * normal + params.odd_share * _ODD_DENSITY, _NEVER))


_NEVER = 1e-9
_ODD_DENSITY = 1 / np.log(4.0 / 0.01)  # of the logarithm of a size between 1 cm and 4 m


def _ends(front: np.ndarray, axis: int) -> np.ndarray:
    """Log-odds that a front's end adds to an edge, from the odds of a front 1 cm before and behind it, along an axis."""
    before, behind = (front.take(np.arange(front.shape[axis]) + off, axis, mode="clip") for off in (-END_CELLS, END_CELLS))
    return tuned(Params).end_weight * np.maximum(np.maximum(np.minimum(before, -behind), np.minimum(behind, -before)), 0)


def _edge(lines: LineSet, end: int, low: float, high: float, start: int, border: float) -> float:
    """Grid position of an end of a rectangle: that of a line between two positions along it, or the region's border."""
    inner = 0 < end < len(lines.ends) - 1
    return (start + lines.position(end - 1, low, high)) * STEP if inner else border


def _boxes(sums: np.ndarray) -> np.ndarray:
    """Sums over all rectangles (left, right, top, bottom) from sums (rows, columns) over the area up to each corner."""
    sums = sums.T
    return (sums[None, :, None, :] - sums[:, None, None, :]) - (sums[None, :, :, None] - sums[:, None, :, None])


def _counts(x: np.ndarray, y: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Number of points (n, 2) in each rectangle (left, right, top, bottom) between positions."""
    below = (points[None, :, 0] < x[:, None])[None] & (points[None, :, 1] < y[:, None])[:, None]
    return _boxes(below.sum(axis=2))


def _separates(along: np.ndarray, across: np.ndarray, clicks: np.ndarray) -> np.ndarray:
    """Whether each inner line (lines, from, to) has clicks of one object, all between two ends, on both sides."""
    (low, first), (high, last) = clicks.min(axis=0), clicks.max(axis=0)
    between = (along[1:-1] > low) & (along[1:-1] <= high)
    return np.asarray(between[:, None, None] & ((across[:, None] <= first) & (across[None] > last))[None])


def _inside(ends: np.ndarray, inset: float) -> np.ndarray:
    """Mask of the inner lines that are farther than `inset` from both borders."""
    return np.asarray((ends > ends[0] + inset) & (ends < ends[-1] - inset))


def _best_cuts(
    value: np.ndarray, uprights: np.ndarray, levels: np.ndarray, several: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """First line and value of the best partition of every rectangle, from small to large; `value` is that of the uncut ones."""
    value = value.copy()
    cut = np.zeros(value.shape, np.int32)
    columns, rows = value.shape[0], value.shape[2]
    for wide in range(1, columns):
        left = np.arange(columns - wide)[:, None]
        for high in range(1, rows):
            top = np.arange(rows - high)[None]
            right, bottom = left + wide, top + high
            best, first = value[left, right, top, bottom], np.zeros((columns - wide, rows - high), np.int32)
            for at in (left + step for step in range(1, wide)):
                parts = value[left, at, top, bottom] + value[at, right, top, bottom] + uprights[at - 1, top, bottom]
                best, first = np.maximum(best, parts), np.where(parts > best, at, first)
            for at in (top + step for step in range(1, high)):
                parts = value[left, right, top, at] + value[left, right, at, bottom] + levels[at - 1, left, right]
                best, first = np.maximum(best, parts), np.where(parts > best, -at, first)
            allowed = several[left, right, top, bottom]
            value[left, right, top, bottom] = np.where(allowed, best, value[left, right, top, bottom])
            cut[left, right, top, bottom] = np.where(allowed, first, 0)
    return cut, value
