"""Recursive XY-cut of a furniture run into panels, along the lines that most of a span shows."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.runs.lines import Evidence
from r2c2r_core.segment.runs.orthomosaic import Cell, joined
from r2c2r_core.tuning import param, tuned

_REAL = "measured on the real kitchen, where 20 of 20 random clicks gave the right panel"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Where a run is cut. Scores of lines are robust deviations over their surroundings, and end at 6."""

    hidden_share: float = param(0.32, "share", "of a line's span that may be unseen or faint", source=_REAL)
    least_z: float = param(0.5, "σ", "of a line's score at that quantile", source=_REAL)
    least_score: float = param(2.2, "score", "of a line: that quantile times the root of the number of blocks", source=_REAL)
    least_prominence: float = param(6.0, "σ", "of the profile's own deviations over its median", source=_REAL)
    smallest_m: float = param(0.09, "m", "side of a panel", source=_REAL, gt=0)
    jitter_m: float = param(0.0075, "m", "over which the blocks of a line may disagree", source=_REAL)
    strip_m: float = param(0.085, "m", "thinner cells of the same hue are handle or shadow lines: merged", source=_REAL)
    deepest: int = param(40, "count", "cuts within each other", source=_REAL, ge=1)
    widest_m: float = param(0.64, "m", "a wider cell is searched again for a fainter seam", source=_REAL)
    faint_hidden_share: float = param(0.45, "share", "of a faint seam's span that may be unseen or faint")
    faint_least_z: float = param(0.8, "σ", "of a faint seam's score at that quantile")
    faint_least_score: float = param(3.0, "score", "of a faint seam")
    faint_least_prominence: float = param(5.0, "σ", "of a faint seam")
    faint_smallest_m: float = param(0.28, "m", "side of a panel beside a faint seam", gt=0)
    faint_jitter_m: float = param(0.0225, "m", "over which the blocks of a faint seam may disagree")
    tried: int = param(40, "count", "lines of a cell that are tried, best first", ge=1)
    short_m: float = param(0.45, "m", "lines across less must be clearer: a knob alone is a third of a drawer")
    least_known: float = param(0.5, "share", "of a line's blocks that must be known")
    uneven_m: float = param(0.025, "m", "neighbours may be cut that differently across")
    enough_z: float = param(2.6, "σ", "prominence that is always enough: strong grain must not outlaw every line")
    even_z: float = param(0.06, "σ", "deviation of a profile, at least")
    shown_z: float = param(1.0, "σ", "of a block that shows the line")
    widest_front_m: float = param(0.98, "m", "width of a front, at most")
    units_first: float = param(2.0, "ratio", "by which a level line may be better than an upright one that breaks it")
    shadow_m: float = param(
        0.025, "m", "height of a shadow below a worktop", source="the edge of the worktop itself is 3-4 cm high"
    )
    clear_z: float = param(2.0, "σ", "of a line's middle that is clear")
    hardly: float = param(0.5, "ratio", "to a line's middle of an end at which it is hardly there")
    plane_ends: float = param(0.4, "share", "of a line along which depth must show an end of the plane")
    other_colour: float = param(14.0, "colour", "CIELAB units between a plinth or a worktop and a panel")
    lightness_weight: float = param(0.5, "ratio", "of a difference in lightness to one in hue")
    hued: float = param(12.0, "colour", "CIELAB chroma of what has a hue")
    grey: float = param(16.0, "colour", "CIELAB chroma of what has none")
    same_hue_deg: float = param(18.0, "deg", "between hues that are one")
    same_light_hued: float = param(60.0, "colour", "CIELAB lightness between parts of one front with a hue")
    same_light_grey: float = param(30.0, "colour", "CIELAB lightness between parts of one front without")


class _Search(NamedTuple):
    """What is asked of a line."""

    hidden_share: float
    least_z: float
    least_score: float
    least_prominence: float
    smallest_m: float
    jitter_m: float


def cut_panels(vertical: Evidence, horizontal: Evidence, mosaic: Image, cell_m: float) -> list[Cell]:
    """Panels of the whole grid, as rectangles that tile it."""
    return _Cutter(vertical, horizontal, mosaic, cell_m).run()


class _Cutter:
    def __init__(self, vertical: Evidence, horizontal: Evidence, mosaic: Image, cell_m: float) -> None:
        self.evidence = (vertical, horizontal)
        self.lab = cv2.cvtColor(mosaic, cv2.COLOR_RGB2LAB).astype(np.float32)
        self.seen: np.ndarray = np.asarray(mosaic.any(axis=2))
        self.cell_m, self.params = cell_m, (params := tuned(Params))
        self.smallest = round(params.smallest_m / cell_m)
        self.usual = _Search(
            params.hidden_share,
            params.least_z,
            params.least_score,
            params.least_prominence,
            params.smallest_m,
            params.jitter_m,
        )
        self.faint = _Search(
            params.faint_hidden_share,
            params.faint_least_z,
            params.faint_least_score,
            params.faint_least_prominence,
            params.faint_smallest_m,
            params.faint_jitter_m,
        )

    def run(self) -> list[Cell]:
        rows, columns = self.seen.shape
        cells: list[Cell] = []
        self._divide(Cell(0, 0, columns, rows), 0, cells)
        return self._merge(self._merge(self._parted(cells), self._frame_line), self._strip)

    def _parted(self, cells: list[Cell]) -> list[Cell]:
        """The cells, level strips parted where the panels below or above them are: a shadow falls on several fronts at once."""
        found: list[Cell] = []
        for cell in cells:
            beside = [other for other in cells if other.top == cell.bottom or other.bottom == cell.top]
            at = {other.left for other in beside if cell.left < other.left < cell.right and other.height > cell.height}
            edges = [cell.left, *sorted(at), cell.right] if cell.height * self.cell_m < self.params.shadow_m else []
            parts = [Cell(left, cell.top, right, cell.bottom) for left, right in pairwise(edges)]
            found += parts or [cell]
        return found

    def _divide(self, cell: Cell, depth: int, out: list[Cell]) -> None:
        candidates = [found for axis in (0, 1) if (found := self._best_line(cell, axis, self.usual)) is not None]
        if not candidates and cell.width * self.cell_m > self.params.widest_m:
            faint = self._best_line(cell, 0, self.faint)  # no front is this wide: believe a seam that is hidden in part
            candidates = [faint] if faint is not None else []
        if not candidates or depth >= self.params.deepest:
            out.append(cell)
            return
        _, axis, position = self._units_first(cell, candidates)
        if axis == 0:
            halves = Cell(cell.left, cell.top, position, cell.bottom), Cell(position, cell.top, cell.right, cell.bottom)
        else:
            halves = Cell(cell.left, cell.top, cell.right, position), Cell(cell.left, position, cell.right, cell.bottom)
        for half in halves:
            self._divide(half, depth + 1, out)

    def _units_first(self, cell: Cell, candidates: list[tuple[float, int, float]]) -> tuple[float, int, float]:
        """The best line, unless it is level, stops where an upright one crosses it, and that one is hardly worse.

        Handles of two units that happen to be level make such a line: it must not cut them before they are apart.
        """
        best = max(candidates)
        if best[1] == 0 or len(candidates) < 2 or cell.width * self.cell_m <= self.params.widest_front_m:
            return best
        upright = min(candidates, key=lambda found: found[1])
        evidence, at = self.evidence[1], round(best[2] - 0.5)
        block = round(upright[2] / evidence.block)
        line = evidence.score[:, max(at - 2, 0) : at + 3].max(axis=1)
        first, last = round(cell.left / evidence.block), round(cell.right / evidence.block)
        broken = line[max(block - 1, 0) : block + 1].min() < self.params.hardly * np.median(line[first:last])
        return upright if broken and upright[0] * self.params.units_first > best[0] else best

    def _best_line(self, cell: Cell, axis: int, search: _Search) -> tuple[float, int, float] | None:
        low, high = (cell.left, cell.right) if axis == 0 else (cell.top, cell.bottom)
        start, stop = round(low), round(high)
        smallest = round(search.smallest_m / self.cell_m)
        if stop - start < 2 * smallest:
            return None
        score, shown, profile = self._line_scores(cell, axis, start, stop, search)
        margin = max(smallest // 4, 1) if search is self.usual else smallest
        score[:margin] = 0
        score[len(score) - margin :] = 0
        # A seam runs from end to end; the inner lines of a framed door stop at its rails, so they come after it.
        rank = np.where(score < search.least_score, 0, score * shown**2 * (1 + self._end_share(cell, axis, start, stop)))
        for i in np.argsort(-rank, kind="stable")[: self.params.tried]:
            if rank[i] <= 0:
                return None
            if self._legal(cell, axis, int(i), stop - start) and not self._is_relief(cell, axis, start + int(i)):
                return float(rank[i]), axis, start + _peak_near(profile, int(i)) + 0.5
        return None

    def _is_relief(self, cell: Cell, axis: int, position: int) -> bool:
        """Whether a line belongs to something on a front, as a handle or a window: it ends short of both edges."""
        if cell.width * self.cell_m > self.params.widest_front_m:
            return False
        across = (cell.top, cell.bottom) if axis == 0 else (cell.left, cell.right)
        return _stops_short(self.evidence[axis], position, *across)

    def _line_scores(
        self, cell: Cell, axis: int, start: int, stop: int, search: _Search
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """At each position: the quantile over blocks times the root of their number, the share that shows it, the mean."""
        evidence = self.evidence[axis]
        across = (cell.top, cell.bottom) if axis == 0 else (cell.left, cell.right)
        first = min(int(np.ceil(across[0] / evidence.block)), len(evidence.score) - 1)
        last = min(max(first + 1, int(across[1] // evidence.block)), len(evidence.score))
        raw = evidence.score[first:last, start:stop]
        known = evidence.known[first:last, start:stop]
        widened = cv2.dilate(raw, np.ones((1, max(round(search.jitter_m / self.cell_m), 1)), np.uint8))
        quantile, count = _trimmed_low(widened, known, search.hidden_share)
        blocks = max(1, last - first)
        score = quantile * np.sqrt(np.minimum(count, blocks))
        short = round(self.params.short_m / self.cell_m) / evidence.block  # blocks
        score[(count < max(2, self.params.least_known * blocks)) | (quantile < search.least_z * max(1.0, short / blocks))] = 0
        seen = quantile[count > 0]
        if len(seen):
            middle = np.median(seen)
            spread = 1.4826 * np.median(np.abs(seen - middle)) + self.params.even_z
            prominence = min(search.least_prominence * spread, self.params.enough_z)  # strong grain must not outlaw every line
            score[quantile - middle < prominence] = 0
        shown = ((widened > self.params.shown_z) & known).sum(axis=0) / np.maximum(count, 1)
        return score, shown, raw.mean(axis=0)

    def _end_share(self, cell: Cell, axis: int, start: int, stop: int) -> np.ndarray:
        """At each position, the share of blocks in which depth shows an end of the plane: surer than any colour."""
        evidence = self.evidence[axis]
        if evidence.ends is None:
            return np.zeros(stop - start)
        low, high = (cell.top, cell.bottom) if axis == 0 else (cell.left, cell.right)
        first = min(int(np.ceil(low / evidence.block)), len(evidence.ends) - 1)
        last = min(max(first + 1, int(high // evidence.block)), len(evidence.ends))
        return np.asarray((evidence.ends[first:last, start:stop] > 2).mean(axis=0))

    def _legal(self, cell: Cell, axis: int, position: int, length: int) -> bool:
        """Both parts are wide enough to be panels, or differ in hue or depth (a plinth, a worktop)."""
        if self.smallest <= position <= length - self.smallest or self._plane_ends(cell, axis, position):
            return True
        if axis == 0:
            parts = (
                Cell(cell.left, cell.top, cell.left + position, cell.bottom),
                Cell(cell.left + position, cell.top, cell.right, cell.bottom),
            )
        else:
            parts = (
                Cell(cell.left, cell.top, cell.right, cell.top + position),
                Cell(cell.left, cell.top + position, cell.right, cell.bottom),
            )
        difference = (self._colour(parts[0]) - self._colour(parts[1])) * [self.params.lightness_weight, 1, 1]
        return bool(np.linalg.norm(difference) > self.params.other_colour)

    def _plane_ends(self, cell: Cell, axis: int, position: int) -> bool:
        """Whether depth shows an end of the plane along most of the line."""
        low, high = (cell.left, cell.right) if axis == 0 else (cell.top, cell.bottom)
        shares = self._end_share(cell, axis, round(low), round(high))
        return bool(shares[min(max(position, 0), len(shares) - 1)] > self.params.plane_ends)

    def _colour(self, cell: Cell) -> np.ndarray:
        area = (slice(round(cell.top), round(cell.bottom), 2), slice(round(cell.left), round(cell.right), 2))
        colours = self.lab[area][self.seen[area]]
        return np.median(colours, axis=0) if len(colours) else np.zeros(3)

    def _merge(self, cells: list[Cell], belongs: Callable[[Cell, Cell], bool]) -> list[Cell]:
        """Join neighbours for which `belongs` holds, smallest first, until there are none."""
        slack = self.params.uneven_m / self.cell_m
        while True:
            pair = next(
                (
                    (thin, other)
                    for thin in sorted(cells, key=lambda cell: (min(cell.width, cell.height), cell.left, cell.top))
                    for other in cells
                    if other is not thin and _side_by_side(thin, other, slack) is not None and belongs(thin, other)
                ),
                None,
            )
            if pair is None:
                return cells
            cells = [cell for cell in cells if cell not in pair] + [_grown_over(pair[1], pair[0])]

    def _strip(self, thin: Cell, other: Cell) -> bool:
        """Whether the line between them is that of a handle or a shadow: one is too thin for a panel, of one hue."""
        strip = round(self.params.strip_m / self.cell_m)
        axis = _side_by_side(thin, other, self.params.uneven_m / self.cell_m) or 0
        position = max(thin.left, other.left) if axis == 0 else max(thin.top, other.top)
        cell = joined([thin, other])
        if self._plane_ends(cell, axis, round(position - (cell.left if axis == 0 else cell.top))):
            return False
        if min(thin.width, thin.height) >= strip or min(other.width, other.height) < strip:
            return False
        return self._similar(thin, other)

    def _frame_line(self, a: Cell, b: Cell) -> bool:
        """Whether the line between them is clear in its middle and ends short of both its ends, as in a framed door."""
        axis = _side_by_side(a, b, self.params.uneven_m / self.cell_m) or 0
        position = max(a.left, b.left) if axis == 0 else max(a.top, b.top)
        low, high = (a.top, a.bottom) if axis == 0 else (a.left, a.right)
        return _stops_short(self.evidence[axis], round(position - 0.5), low, high) and self._similar(a, b)

    def _similar(self, a: Cell, b: Cell) -> bool:
        first, second = self._colour(a), self._colour(b)
        hue_a, hue_b = first[1:] - 128, second[1:] - 128
        chroma_a, chroma_b = np.linalg.norm(hue_a), np.linalg.norm(hue_b)
        params = self.params
        if min(chroma_a, chroma_b) > params.hued:
            same_hue = hue_a @ hue_b > chroma_a * chroma_b * np.cos(np.radians(params.same_hue_deg))
            return bool(same_hue and abs(first[0] - second[0]) < params.same_light_hued)
        return bool(max(chroma_a, chroma_b) < params.grey and abs(first[0] - second[0]) < params.same_light_grey)


def _stops_short(evidence: Evidence, position: int, low: float, high: float) -> bool:
    """Whether a line across low..high is clear in its middle and hardly there at both of its ends."""
    params = tuned(Params)
    first, last = round(low / evidence.block), min(round(high / evidence.block), len(evidence.score))
    if last - first < 3:
        return False
    at = min(max(position, 2), evidence.score.shape[1] - 3)
    known = evidence.known[first:last, at]
    line = evidence.score[first:last, at - 2 : at + 3].max(axis=1)
    inner = line[1:-1][known[1:-1]]
    if not (known[0] and known[-1] and len(inner)):
        return False
    middle = float(np.median(inner))
    return middle > params.clear_z and float(line[[0, -1]].max()) < params.hardly * middle


def _side_by_side(a: Cell, b: Cell, slack: float) -> int | None:
    """0 when they stand beside each other with about the same span, 1 when above each other, None otherwise."""
    if abs(a.top - b.top) < slack and abs(a.bottom - b.bottom) < slack and (a.right == b.left or a.left == b.right):
        return 0
    if abs(a.left - b.left) < slack and abs(a.right - b.right) < slack and (a.bottom == b.top or a.top == b.bottom):
        return 1
    return None


def _grown_over(cell: Cell, other: Cell) -> Cell:
    """A cell extended over its neighbour; across, it keeps its own span."""
    if cell.right == other.left or cell.left == other.right:
        return Cell(min(cell.left, other.left), cell.top, max(cell.right, other.right), cell.bottom)
    return Cell(cell.left, min(cell.top, other.top), cell.right, max(cell.bottom, other.bottom))


def _trimmed_low(score: np.ndarray, known: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Per position, the `share` quantile over its known blocks, and how many there are."""
    count = known.sum(axis=0)
    ordered = np.sort(np.where(known, score, np.inf), axis=0)
    rank = np.floor(count * share).astype(int).clip(0, len(score) - 1)
    value = np.take_along_axis(ordered, rank[None], axis=0)[0]
    return np.where(count > 0, value, 0.0), count


def _peak_near(profile: np.ndarray, position: int) -> float:
    """Sub-cell position of the profile's peak within two cells."""
    low, high = max(0, position - 2), min(len(profile), position + 3)
    i = low + int(np.argmax(profile[low:high]))
    if 0 < i < len(profile) - 1:
        a, b, c = profile[i - 1], profile[i], profile[i + 1]
        if a + c - 2 * b < -1e-9:
            return i + float(np.clip((a - c) / (2 * (a - 2 * b + c)), -0.5, 0.5))
    return float(i)
