"""Contrast of lines and edges on a run's orthomosaic, at any position along them."""

import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.mosaics.edges import as_lab
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.runs.xy_cut import across

SIDES = ((0, 0), (0, 1), (1, 0), (1, 1))
"""Left, right, upper, lower: the axis of an edge of a panel, and the end along it."""
CORNER = 3
"""Cells at a line's ends where lines across it show."""
_PARTS = 8  # per line
_OFF = 2  # cells by which a line may deviate
_MARGIN = 12  # cells around an edge that are read for comparison


def edge_changes(mosaic: Image, panel: Cell) -> tuple[float, ...]:
    """CIELAB colour change at each edge of a panel, median along it: left, right, upper, lower; 0 where no frame shows it."""
    left, top = max(int(panel.left) - _MARGIN, 0), max(int(panel.top) - _MARGIN, 0)
    lab, seen = as_lab(np.ascontiguousarray(mosaic[top : int(panel.bottom) + _MARGIN, left : int(panel.right) + _MARGIN]))
    moved = Cell(panel.left - left, panel.top - top, panel.right - left, panel.bottom - top)
    found = []
    for (axis, _), at in zip(SIDES, edges_of(moved), strict=True):
        low, high = across(moved, 1 - axis)
        squares = sum(Contrast(lab[..., k]).changes(axis, at, low + CORNER, high - CORNER) ** 2 for k in range(3))
        shown = Contrast(seen.astype(np.float32)).changes(axis, at, low + CORNER, high - CORNER) == 0
        found.append(float(np.median((shown * np.sqrt(squares)).max(axis=1))))
    return tuple(found)


def edges_of(panel: Cell) -> tuple[float, float, float, float]:
    """Edge positions of a panel, in the order of SIDES."""
    return panel.left, panel.right, panel.top, panel.bottom


class Contrast:
    """Contrast of lines against both of their sides, in a mosaic's lightness (rows, columns)."""

    def __init__(self, light: np.ndarray) -> None:
        self._light = light

    def near(self, axis: int, start: int, stop: int, low: float, high: float) -> np.ndarray:
        """Contrast of lines from `low` to `high` at positions from `start` up to `stop`: (parts of the line, positions)."""
        before, middle, after = self._sides(axis, start, stop, low, high, _PARTS)
        darker, lighter = np.minimum(before, after) - middle, middle - np.maximum(before, after)
        return np.asarray(np.maximum(np.maximum(darker, lighter), 0))

    def along(self, axis: int, at: float, low: float, high: float) -> np.ndarray:
        """Maximum contrast of the line near a position: (parts,)."""
        return np.asarray(self.near(axis, max(int(at) - _OFF, 0), int(at) + _OFF + 1, low, high).max(axis=1))

    def changes(self, axis: int, at: float, low: float, high: float, parts: int = _PARTS) -> np.ndarray:
        """Lightness change at and around a position, of a gap or from one side to the other: (parts of the line, positions)."""
        return np.asarray(
            np.ptp(np.stack(self._sides(axis, max(int(at) - _OFF, 0), int(at) + _OFF + 1, low, high, parts)), axis=0)
        )

    def _sides(
        self, axis: int, start: int, stop: int, low: float, high: float, parts: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mean lightness before, at and after each position (parts of the line, positions); all 0 where the grid ends."""
        first, last, begin = round(low), round(high), max(start - 5, 0)
        around = self._light[first:last, begin : stop + 5] if axis == 0 else self._light[begin : stop + 5, first:last].T
        if len(around) < parts or around.shape[1] < stop - begin:
            nothing = np.zeros((parts, max(stop - start, 1)))
            return nothing, nothing, nothing
        at = np.arange(parts) * len(around) // parts
        means = np.add.reduceat(around, at, axis=0) / np.diff(at, append=len(around))[:, None]
        padded = np.pad(means, ((0, 0), (4, 4)), mode="edge")
        by = {k: padded[:, 4 + k + start - begin : 4 + k + stop - begin] for k in range(-4, 5)}
        return (by[-4] + by[-3]) / 2, (by[-1] + by[0] + by[1]) / 3, (by[3] + by[4]) / 2
