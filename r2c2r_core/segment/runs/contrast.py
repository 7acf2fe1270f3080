"""Colour change at the edges of a panel on a run's orthomosaic."""

import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.mosaics.edges import as_lab
from r2c2r_core.segment.mosaics.orthomosaic import Cell

_CORNER = 3  # cells at an edge's ends where lines across it show
_PARTS = 8  # per edge
_OFF = 2  # cells by which an edge may deviate
_MARGIN = 12  # cells around an edge that are read for comparison


def edge_changes(mosaic: Image, panel: Cell) -> tuple[float, ...]:
    """CIELAB colour change at each edge of a panel, median along it: left, right, upper, lower; 0 where no frame shows it."""
    left, top = max(int(panel.left) - _MARGIN, 0), max(int(panel.top) - _MARGIN, 0)
    lab, seen = as_lab(np.ascontiguousarray(mosaic[top : int(panel.bottom) + _MARGIN, left : int(panel.right) + _MARGIN]))
    columns, rows = (panel.left - left, panel.right - left), (panel.top - top, panel.bottom - top)
    found = []
    for axis, ends, beside in ((0, columns, rows), (1, rows, columns)):
        values, known = (lab, seen[..., None]) if axis == 0 else (lab.swapaxes(0, 1), seen.T[..., None])
        for at in ends:
            change = _changes(values, at, *beside)
            shown = _changes(known.astype(np.float32), at, *beside) == 0
            found.append(float(np.median((shown * change).max(axis=1))))
    return tuple(found)


def _changes(values: np.ndarray, at: float, low: float, high: float) -> np.ndarray:
    """Change of values (rows, columns, channels) around a column between two rows, of a gap or from one side to the other.

    (parts of the line, columns); 0 where the grid ends.
    """
    first, last, start, stop = round(low + _CORNER), round(high - _CORNER), max(int(at) - _OFF, 0), int(at) + _OFF + 1
    begin = max(start - 5, 0)
    around = values[first:last, begin : stop + 5]
    if len(around) < _PARTS or stop <= start or around.shape[1] < stop - begin:
        return np.zeros((_PARTS, max(stop - start, 1)))
    parts = np.arange(_PARTS) * len(around) // _PARTS
    means = np.add.reduceat(around, parts, axis=0) / np.diff(parts, append=len(around))[:, None, None]
    padded = np.pad(means, ((0, 0), (4, 4), (0, 0)), mode="edge")
    by = {k: padded[:, 4 + k + start - begin : 4 + k + stop - begin] for k in range(-4, 5)}
    sides = ((by[-4] + by[-3]) / 2, (by[-1] + by[0] + by[1]) / 3, (by[3] + by[4]) / 2)
    return np.asarray(np.linalg.norm(np.ptp(np.stack(sides), axis=0), axis=2))
