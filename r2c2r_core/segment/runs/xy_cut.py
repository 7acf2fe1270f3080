"""Recursive XY-cut of a furniture run into panels, along the paths that are most likely edges of fronts."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the XY-cut. Odds are natural logarithms: 0 is even."""

    hidden: float = param(0.3, "share", "Maximum fraction of a line's span without a visible edge: handles, occluders")
    apart_m: float = param(0.015, "m", "Minimum distance between two lines: a gap has one", gt=0)
    beside_m: float = param(0.02, "m", "Maximum distance from a line to a front for the line to be its edge", gt=0)
    end_m: float = param(0.01, "m", "Search distance for an edge around the end of fronts", gt=0)
    shortest_m: float = param(0.06, "m", "Minimum length of a line's span along fronts", gt=0)
    block_m: float = param(0.03, "m", "Length along a line over which its odds are pooled and its position is constant", gt=0)
    step: float = param(0.5, "log", "Cost of a one-cell sidestep of a line between blocks: poses and lenses bend lines")
    bend_m: float = param(
        0.03,
        "m",
        "Maximum deviation of a line from its median position: beyond, it is another stack's seam",
        gt=0,
        source="a real kitchen's poses bend its lines by more than 2 cm",
    )
    usual_width_m: float = param(0.5, "m", "Median width of a front", gt=0, source="units sold are 0.3 to 0.6 m wide")
    usual_height_m: float = param(
        0.45, "m", "Median height of a front", gt=0, source="drawers 0.14 m, doors 0.72 m, tall doors 2 m"
    )
    width_spread: float = param(0.5, "log", "Standard deviation of the logarithm of fronts' widths", gt=0)
    height_spread: float = param(0.9, "log", "Standard deviation of the logarithm of fronts' heights", gt=0)
    odd_share: float = param(0.05, "share", "Fraction of parts of any size: fillers, end panels, wide fronts", gt=0, lt=1)
    odd_handle: float = param(
        0.2, "share", "Factor of that fraction among parts with a handle: pull-outs, wide fronts", gt=0, lt=1
    )
    handled_m: tuple[float, float] = param(
        (0.12, 0.07), "m", "Minimum width and height of a part with a handle", source="units from 0.15 m, drawers from 0.08 m"
    )
    size_weight: float = param(
        0.5, "ratio", "Weight of the size prior: the network has learned part of it from its training data"
    )
    handle_weight: float = param(1, "ratio", "Weight of the handle prior, for the same reason")
    no_handle: float = param(0.5, "share", "Fraction of fronts without a handle", gt=0, lt=1)
    two_handles: float = param(0.01, "share", "Fraction of fronts with two handles", gt=0, lt=1)
    more_handles: float = param(0.25, "ratio", "Factor of that fraction for each further handle", gt=0, lt=1)
    possible: float = param(-3.0, "log", "Minimum mean log-odds of a line for other evidence to make it an edge")
    crossed: float = param(3.0, "log", "Maximum log-odds added to a line beyond which both lines across it end")
    crossed_m: float = param(
        0.02, "m", "Length over which those lines must be absent for the full gain", gt=0, source="rails are 2-5 cm wide"
    )
    blur_m: float = param(
        0.01, "m", "Distance beside a line over which lines across it may seem to continue", source="two cells of the odds"
    )
    handle_cells: int = param(4, "count", "Minimum number of cells of a handle", gt=0)


class Line(NamedTuple):
    """A cut. `total` is the sum of log-odds along it, over the cells that are beside a front.

    Lines compare by priority; the greatest is cut first. Unbroken lines lead: a line that is no edge along part of its span,
    however likely overall, would cut through a front there that other lines separate from the rest.
    """

    unbroken: bool  # an edge is possible all along
    total: float
    axis: int  # 0 upright, 1 level
    position: float  # in grid cells
    odds: float  # mean


class Paths(NamedTuple):
    """Most probable path to each position at the end of a span, (blocks, positions)."""

    at: np.ndarray  # position in each block
    odds: np.ndarray
    beside: np.ndarray  # whether it is beside a front
    score: np.ndarray  # (positions,) sum of odds minus the cost of sidesteps


def cut_panels(odds: PanelOdds, grid: Cell, cell_m: float) -> list[Cell]:
    """Panels of a grid, as rectangles that tile it; each is cut by the evidence within it alone."""
    field, found, waiting = LineField(odds, cell_m), [], [grid]
    while waiting:
        cell = waiting.pop()
        line = field.best_cut(cell) or field.end_of_fronts(cell)
        if line is None:
            found.append(cell)
        else:
            waiting += halves(cell, line)
    return found


def across(cell: Cell, axis: int) -> tuple[float, float]:
    """A cell's ends along the positions of an axis."""
    return (cell.left, cell.right) if axis == 0 else (cell.top, cell.bottom)


def halves(cell: Cell, line: Line) -> tuple[Cell, Cell]:
    """Both sides of a cut: left and right of it, or above and below."""
    if line.axis == 0:
        return (
            Cell(cell.left, cell.top, line.position, cell.bottom),
            Cell(line.position, cell.top, cell.right, cell.bottom),
        )
    return Cell(cell.left, cell.top, cell.right, line.position), Cell(cell.left, line.position, cell.right, cell.bottom)


class LineField:
    """Log-odds of lines over a grid."""

    def __init__(self, odds: PanelOdds, cell_m: float) -> None:
        self.params, self.cell_m = (params := tuned(Params)), cell_m * STEP
        self.odds = (odds.upright, odds.level.T)
        self.front_odds = (odds.front, odds.front.T)
        self.front = (odds.front > 0, (odds.front > 0).T)
        reach = 2 * round(params.beside_m / self.cell_m) + 1
        self.handles = _centres(odds.handle > 0, params.handle_cells)
        self.beside = (
            cv2.dilate(odds.front, np.ones((1, reach), np.uint8)) > 0,
            (cv2.dilate(odds.front, np.ones((reach, 1), np.uint8)) > 0).T,
        )

    def best_cut(self, cell: Cell) -> Line | None:
        """Cut with the highest log-likelihood, among lines more likely than not over the span of the cell."""
        return max((line for axis in (0, 1) if (line := self._best(cell, axis)) is not None), default=None)

    def end_of_fronts(self, cell: Cell) -> Line | None:
        """Likeliest line where fronts end within a cell: an edge must be there, however faint, if the border is none.

        Its log-odds must exceed the mean log-odds of a front beyond it.
        """
        margin, reach = max(2, round(self.params.apart_m / self.cell_m)), max(1, round(self.params.end_m / self.cell_m))
        found = []
        for axis in (0, 1):
            low, high = across(cell, axis)
            start, stop = round(low / STEP), round(high / STEP)
            on = self.front[axis][self._span(cell, axis), start:stop].mean(axis=0) > 0.5 if stop > start else np.zeros(0)
            if on.sum() * self.cell_m < self.params.shortest_m:
                continue
            ends = ((int(np.argmax(on)), low), (len(on) - int(np.argmax(on[::-1])), high))
            for end, border in ((end, border) for end, border in ends if margin <= end <= len(on) - margin):
                near = max(end - reach, 1), min(end + reach, len(on) - 1)
                line = self.best_between(cell, axis, (start + near[0]) * STEP, (start + near[1]) * STEP)
                if line is None or not low + STEP <= line.position <= high - STEP:
                    continue
                beyond = slice(start + end, stop) if border == high else slice(start, start + end)
                front = float(self.front_odds[axis][self._span(cell, axis), beyond].mean())
                if line.odds > max(self._border(cell, axis, border), front):
                    found.append(line)
        return max(found, default=None)

    def _border(self, cell: Cell, axis: int, border: float) -> float:
        """Log-odds that a line beside a cell border must exceed: the border's, where that is an edge itself."""
        line = self.best_between(cell, axis, border - STEP, border + STEP)
        return line.odds if line is not None and line.odds > 0 else -np.inf

    def best_between(self, cell: Cell, axis: int, start: float, stop: float, *, sized: bool = False) -> Line | None:
        """Likeliest line over the span of a cell with its position from `start` to `stop`, however unlikely.

        `sized` adds the prior by sizes and handles of both parts to the choice and `total`, but not to `odds`.
        """
        first = max(int(start // STEP), 0)
        last = min(max(round(stop / STEP), first + 1), self.odds[axis].shape[1])
        paths = self._paths(cell, axis, first, last)
        if paths is None:
            return None
        prior = self._prior(cell, axis, first, last) if sized else np.zeros(last - first)
        best = int(np.argmax(paths.score + len(paths.at) * prior))
        mean = float(paths.odds[:, best].mean())
        span, unbroken = self._span(cell, axis), bool(self._unbroken(cell, axis, paths)[best])
        position = self._centre(cell, axis, first + paths.at[:, best], np.ones(len(paths.at), bool))
        return Line(unbroken, (mean + float(prior[best])) * (span.stop - span.start), axis, position * STEP, mean)

    def _within(self, cell: Cell, axis: int) -> tuple[int, int]:
        """Range of positions of lines far enough from a cell's ends."""
        low, high = across(cell, axis)
        margin = max(1, round(self.params.apart_m / self.cell_m))
        return round(low / STEP) + margin, min(round(high / STEP), self.odds[axis].shape[1]) - margin

    def best_uncut(self, cell: Cell, inset_m: float, faintest: float) -> float:
        """Log-odds, without sizes, of the likeliest possible line at least `inset_m` within a cell; -inf without one.

        Its faintest part counts (that quantile): a seam runs from edge to edge, the inner edge of a frame ends at rails.
        """
        inset, best = inset_m / self.cell_m, -np.inf
        for axis in (0, 1):
            low, high = across(cell, axis)
            start, stop = round(low / STEP + inset), min(round(high / STEP - inset), self.odds[axis].shape[1])
            paths = self._paths(cell, axis, start, stop)
            if paths is not None:
                odds = np.quantile(paths.odds, faintest, axis=0)
                best = max(best, float(odds[self._unbroken(cell, axis, paths)].max(initial=-np.inf)))
        return best

    def _best(self, cell: Cell, axis: int) -> Line | None:
        params = self.params
        (low, high), (start, stop) = across(cell, axis), self._within(cell, axis)
        span = self._span(cell, axis)
        paths = self._paths(cell, axis, start, stop)
        if paths is None:
            return None
        count = paths.beside.sum(axis=0)
        prior = self._prior(cell, axis, start, stop) + self._crossed(cell, axis, start, stop, paths)
        ordered = np.sort(np.where(paths.beside, paths.odds, np.inf), axis=0)
        rank = np.minimum((params.hidden * count).astype(int), len(ordered) - 1)
        least = np.take_along_axis(ordered, rank[None], axis=0)[0] + prior
        total = np.where(paths.beside, paths.odds, 0).sum(axis=0) + prior * count
        block = (span.stop - span.start) / len(paths.at)
        legal = (count * block * self.cell_m >= params.shortest_m) & (least > 0) & (total > 0)
        if not legal.any():
            return None
        unbroken = legal & self._unbroken(cell, axis, paths)
        best = int(np.argmax(np.where(unbroken if unbroken.any() else legal, total, -np.inf)))
        position = self._centre(cell, axis, start + paths.at[:, best], paths.beside[:, best])
        if not low + STEP <= position * STEP <= high - STEP:
            return None
        return Line(bool(unbroken[best]), float(total[best] * block), axis, position * STEP, float(total[best] / count[best]))

    def _unbroken(self, cell: Cell, axis: int, paths: Paths) -> np.ndarray:
        """Mask of the lines that are possible all along fronts, except for as much as a handle hides."""
        span = self._span(cell, axis)
        block_m = (span.stop - span.start) / len(paths.at) * self.cell_m
        broken = (paths.beside & (paths.odds < self.params.possible)).sum(axis=0)
        return np.asarray(broken * block_m < self.params.shortest_m)

    def _paths(self, cell: Cell, axis: int, start: int, stop: int) -> Paths | None:
        """Viterbi paths through the span of a cell, at positions from `start` up to `stop`."""
        span = self._span(cell, axis)
        if stop <= start or span.stop <= span.start:
            return None
        odds, beside = self.odds[axis][span, start:stop], self.beside[axis][span, start:stop]
        if not odds.size:
            return None
        odds, beside = self._pooled(odds), self._pooled(beside.astype(np.float32)) > 0.5
        params = self.params
        step, worth = params.step, np.where(beside, odds, 0)
        score, came = worth[0], []
        for row in worth[1:]:
            beyond = np.pad(score, 1, constant_values=-np.inf)
            ways = np.stack([score, beyond[:-2] - step, beyond[2:] - step])
            chosen = ways.argmax(axis=0)
            came.append(np.array([0, -1, 1])[chosen])
            score = ways.max(axis=0) + row
        path = [np.arange(len(score))]
        for moves in reversed(came):
            path.append(path[-1] + moves[path[-1]])
        at = np.stack(path[::-1])
        bend, middle = round(params.bend_m / self.cell_m), np.median(at, axis=0).astype(int)
        at = np.clip(at, middle - bend, middle + bend)
        score = np.take_along_axis(worth, at, axis=1).sum(axis=0) - params.step * np.abs(np.diff(at, axis=0)).sum(axis=0)
        return Paths(at, np.take_along_axis(odds, at, axis=1), np.take_along_axis(beside, at, axis=1), score)

    def _pooled(self, values: np.ndarray) -> np.ndarray:
        """Means over blocks along lines."""
        count = max(1, round(len(values) * self.cell_m / self.params.block_m))
        starts = np.arange(count) * len(values) // count
        sizes = np.diff(starts, append=len(values))
        return np.asarray(np.add.reduceat(values, starts, axis=0) / sizes[:, None])

    def _prior(self, cell: Cell, axis: int, start: int, stop: int) -> np.ndarray:
        """Log-odds of a cut at each position by sizes and handles of both parts, where both are mostly fronts."""
        low, high = (round(value / STEP) for value in across(cell, axis))
        on = np.cumsum(np.pad(self.front[axis][self._span(cell, axis), low:high].mean(axis=0), (1, 0)))
        at = np.arange(start, stop) - low
        before, after = at + 0.5, high - low - at - 0.5
        fronts = (on[at] > 0.5 * before) & (on[-1] - on[at] > 0.5 * after)
        handles = self._handles_in(cell, axis)
        first = np.searchsorted(handles, np.arange(start, stop) + 0.5)
        count = len(handles)
        sizes = self._log_density(before, axis, first) + self._log_density(after, axis, count - first)
        sizes -= self._log_density(before + after, axis, np.full_like(first, count))
        shares = self._log_share(first) + self._log_share(count - first) - self._log_share(np.array(count))
        return np.where(fronts, self.params.size_weight * sizes + self.params.handle_weight * shares, 0.0)

    def _crossed(self, cell: Cell, axis: int, start: int, stop: int, paths: Paths) -> np.ndarray:
        """Log-odds of a cut at each position by the cell's borders across it, which are edges of a front over its full length.

        Where both are edges over most of a cell, but not in the smaller part that a cut would leave, the front ends at the cut:
        a rail of a frame follows.
        """
        params, worth = self.params, np.zeros(stop - start)
        borders = self._borders(cell, axis)
        if borders is None or np.median(borders, axis=1).min() <= 0:
            return worth
        sums, blur = np.cumsum(np.pad(borders, ((0, 0), (1, 0))), axis=1), round(params.blur_m / self.cell_m)
        at, length = np.arange(start, stop) - round(across(cell, axis)[0] / STEP), borders.shape[1]
        for first, last in ((np.zeros_like(at), at - blur), (at + 1 + blur, np.full_like(at, length))):
            size = last - first
            inside = (size > 0) & (size < length / 2)
            first, last = first[inside], last[inside]
            absent = -((sums[:, last] - sums[:, first]) / size[inside]).max(axis=0)
            part = np.minimum(size[inside] * self.cell_m / params.crossed_m, 1)
            worth[inside] = np.maximum(worth[inside], np.clip(absent * part, 0, params.crossed))
        return np.where(paths.odds.mean(axis=0) > params.possible, worth, 0)

    def _borders(self, cell: Cell, axis: int) -> np.ndarray | None:
        """Odds (2, positions) of a cell's borders across the lines of an axis; None at the end of the grid."""
        span, odds = self._span(cell, 1 - axis), self.odds[1 - axis]
        at = [round(border / STEP - 0.5) for border in across(cell, 1 - axis)]
        if at[0] < 1 or at[1] > odds.shape[1] - 2 or span.stop > len(odds):
            return None
        return np.stack([odds[span, border - 1 : border + 2].max(axis=1) for border in at])

    def _handles_in(self, cell: Cell, axis: int) -> np.ndarray:
        """Positions of the centres of handles within a cell, ascending."""
        (low, high), span, along = across(cell, axis), self._span(cell, axis), self.handles[:, axis]
        beside = self.handles[:, 1 - axis]
        inside = (along * STEP >= low) & (along * STEP < high) & (beside >= span.start) & (beside < span.stop)
        return np.sort(along[inside])

    def _log_share(self, count: np.ndarray) -> np.ndarray:
        """Log of the fraction of fronts with `count` handles."""
        params = self.params
        more = np.log(params.two_handles) + np.log(params.more_handles) * (count - 2)
        one = np.log(1 - params.no_handle - params.two_handles / (1 - params.more_handles))
        return np.select([count == 0, count == 1], [np.log(params.no_handle), one], more)

    def _log_density(self, cells: np.ndarray, axis: int, handles: np.ndarray) -> np.ndarray:
        """Log-density of the logarithm of a part's size, by its number of handles: fillers and end panels have none."""
        params = self.params
        usual, spread = (
            (params.usual_width_m, params.width_spread) if axis == 0 else (params.usual_height_m, params.height_spread)
        )
        size_m = np.maximum(cells, 1) * self.cell_m
        z = np.log(size_m / usual) / spread
        normal = np.exp(-0.5 * z * z) / (spread * np.sqrt(2 * np.pi))
        odd = np.where(handles > 0, params.odd_share * params.odd_handle, params.odd_share)
        density = np.where((handles > 0) & (size_m < params.handled_m[axis]), _NEVER, (1 - odd) * normal + odd * _ODD_DENSITY)
        return np.asarray(np.log(density))

    def _span(self, cell: Cell, axis: int) -> slice:
        low, high = across(cell, 1 - axis)
        return slice(round(low / STEP), round(high / STEP))

    def _centre(self, cell: Cell, axis: int, at: np.ndarray, beside: np.ndarray) -> float:
        """Mean position of a path, with subcell accuracy: the mean over cells around it, weighted by their mean odds."""
        odds = self._pooled(self.odds[axis][self._span(cell, axis)])
        near = np.arange(-2, 3)
        columns = np.clip(at[beside][:, None] + near, 0, odds.shape[1] - 1)
        weights = np.exp(np.take_along_axis(odds[beside], columns, axis=1).mean(axis=0))
        return float(at[beside].mean() + 0.5 + near @ weights / weights.sum())


_NEVER = 1e-9
_ODD_DENSITY = 1 / np.log(4.0 / 0.01)  # of the logarithm of a size between 1 cm and 4 m


def _centres(mask: np.ndarray, least: int) -> np.ndarray:
    """Columns and rows (n, 2) of the centres of a mask's connected components of at least `least` cells."""
    _, _, stats, centres = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    return np.asarray(centres[1:][stats[1:, cv2.CC_STAT_AREA] >= least])
