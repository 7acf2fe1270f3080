"""Handle detection on panels: the network's log-odds, with protrusion and parallax from depth."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.calibration import probability
from r2c2r_core.model.motion import Source
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Params as ReliefParams
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of handle detection."""

    parallax_m: float = param(
        0.02,
        "m",
        "Maximum displacement of a handle in the mosaic from its true place",
        source="4 cm of protrusion seen from 25 degrees off",
    )
    seen: float = param(
        0.25, "share", "Minimum count of depth points at a position of a handle, relative to their median", gt=0
    )
    parted_m: float = param(
        0.04, "m", "Maximum gap between parts of one handle", source="glare splits bars, the rim of a cup pull its middle"
    )
    fainter: float = param(2.0, "log", "Maximum decrease of log-odds along a bar", source="7-Scenes: 0.2-0.6 to -0.8..-1.5")
    clear_m: float = param(0.04, "m", "Minimum distance of faint parts from an end of the panel, where lines of frames end")
    shown: float = param(0.25, "share", "Minimum raised fraction of bars in depth", source="samples: > 0.37, 7-Scenes: < 0.07")
    beside_odds: float = param(-0.5, "log", "Minimum log-odds at the height of a row's handles", source="7-Scenes: -0.2")
    aligned_m: float = param(0.04, "m", "Maximum offset of edges and handles in a row", source="7-Scenes kitchen: 3 cm, 1 cm")


@dataclass(frozen=True, slots=True, kw_only=True)
class GridHandle:
    """A handle in grid cells, with a confidence 0..1."""

    left: float
    top: float
    right: float
    bottom: float
    confidence: float
    protrusion_m: float = 0.0  # 0: not measured
    source: Source = "measured"

    @property
    def width(self) -> float:
        """Width in grid cells."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height in grid cells."""
        return self.bottom - self.top


def find_handles(odds: PanelOdds, relief: Relief, cells: Sequence[Cell]) -> tuple[GridHandle | None, ...]:
    """Likeliest handle of each panel of a run; fainter ones count at the height of their row's handles."""
    found = [find_handle(odds, relief, cell) for cell in cells]
    bands = {k: shared_band(odds, relief, cells, found, cell) for k, cell in enumerate(cells) if _is_front(odds, cell)}
    faint = {k: find_handle(odds, relief, band, tuned(Params).beside_odds) for k, band in bands.items() if band is not None}
    return tuple(handle or faint.get(k) for k, handle in enumerate(found))


def shared_band(
    odds: PanelOdds, relief: Relief, cells: Sequence[Cell], handles: Sequence[GridHandle | None], panel: Cell
) -> Cell | None:
    """Part of a panel at the height where most fronts level with it have their handle; None where most have none there."""
    slack = tuned(Params).aligned_m / relief.cell_m * STEP
    level = [
        max(abs(cell.top - panel.top), abs(cell.bottom - panel.bottom)) <= slack and _is_front(odds, cell) for cell in cells
    ]
    found = [handle for handle, is_level in zip(handles, level, strict=True) if is_level and handle is not None]
    shared = max(([one for one in found if abs(one.top - each.top) <= slack] for each in found), key=len, default=[])
    if 2 * len(shared) <= max(sum(level), 2):
        return None
    top, bottom = min(one.top for one in shared) - slack, max(one.bottom for one in shared) + slack
    return Cell(panel.left, max(top, panel.top), panel.right, min(bottom, panel.bottom))


def find_handle(odds: PanelOdds, relief: Relief, cell: Cell, least: float = 0.0) -> GridHandle | None:
    """Likeliest handle of a panel; None where the network sees none with log-odds above `least`."""
    area = _window(odds, cell)
    panel, (top, left) = odds.handle[area] - least, (each.start for each in area)
    if panel.size == 0 or panel.max() <= 0:
        return None
    params = tuned(Params)
    size = 2 * round(params.parted_m / relief.cell_m / 2) + 1
    likely = (panel > 0).astype(np.uint8)
    raised = (relief.count * relief.raised)[area]
    stands_out = likely | (relief.raised[area] > 0.5)  # depth shows a bar where glare hides it from the network
    closed = cv2.morphologyEx(stands_out, cv2.MORPH_CLOSE, np.ones((size, size), np.uint8))
    labels = np.where(likely > 0, cv2.connectedComponents(closed)[1], 0)
    inside = labels == np.bincount(labels.ravel(), np.maximum(panel, 0).ravel()).argmax()
    rows, columns = _extent(inside)
    if min(np.ptp(rows), np.ptp(columns)) + 1 > round(tuned(ReliefParams).handle_thick_m / relief.cell_m):  # print as well
        inside = (likely > 0) & _likeliest_rectangle(panel)
    rows, columns = _whole_bar(panel, relief.raised[area], inside, round(params.clear_m / relief.cell_m))
    lift_m = float(np.average(relief.lift_m[area][inside], weights=raised[inside])) if raised[inside].any() else 0.0
    down, across = _shift(raised, rows, columns, round(params.parallax_m / relief.cell_m))
    return GridHandle(
        left=float(left + columns[0] + across) * STEP,
        top=float(top + rows[0] + down) * STEP,
        right=float(left + columns[-1] + 1 + across) * STEP,
        bottom=float(top + rows[-1] + 1 + down) * STEP,
        protrusion_m=lift_m,
        confidence=probability(float(panel[inside].mean()) + least),
    )


def _window(odds: PanelOdds, cell: Cell) -> tuple[slice, slice]:
    """Rows and columns of a panel in the network's cells."""
    top, bottom, left, right = (max(round(edge / STEP), 0) for edge in (cell.top, cell.bottom, cell.left, cell.right))
    return slice(top, min(bottom, odds.handle.shape[0])), slice(left, min(right, odds.handle.shape[1]))


def _is_front(odds: PanelOdds, cell: Cell) -> bool:
    """Whether a panel is more likely a front than not."""
    return bool(odds.front[_window(odds, cell)].sum() > 0)


def _whole_bar(odds: np.ndarray, raised: np.ndarray, inside: np.ndarray, clear: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of a bar: its likely cells, and fainter ones that continue it, unlike shadows beside it.

    Where depth shows the bar, it ends there too.
    """
    params, (rows, columns) = tuned(Params), _extent(inside)
    if len(rows) >= len(columns):
        return (rows, columns) if len(rows) == len(columns) else _whole_bar(odds.T, raised.T, inside.T, clear)[::-1]
    usual = np.median(raised[inside])
    along = odds[rows].max(axis=0) > odds[inside].mean() - params.fainter
    along &= (raised[rows].mean(axis=0) > usual / 2) | (usual < params.shown)
    along[columns] = True
    ends = np.flatnonzero(np.diff(np.pad(along, 1)))
    start, stop = ends[ends <= columns[0]][-1], ends[ends > columns[-1]][0]
    return rows, np.arange(start, stop) if clear <= start and stop <= len(along) - clear else columns


def _extent(inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns with cells of a mask."""
    return np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))


def _likeliest_rectangle(odds: np.ndarray) -> np.ndarray:
    """Maximum-likelihood rectangle of a handle, as a mask: the largest sum of log-odds, as of independent cells."""
    sums = np.pad(odds.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    rows, best, mask = np.flatnonzero((odds > 0).any(axis=1)), -np.inf, np.zeros(odds.shape, dtype=bool)
    for top in rows:
        bottoms = rows[rows >= top] + 1
        band = sums[bottoms] - sums[top]  # sums from the left end up to each column
        gains = band - np.minimum.accumulate(band, axis=1)
        bottom, right = np.unravel_index(gains.argmax(), gains.shape)
        if gains[bottom, right] > best:
            best, left = gains[bottom, right], band[bottom, : right + 1].argmin()
            mask[:] = False
            mask[top : bottoms[bottom], left:right] = True
    return mask


def _shift(raised: np.ndarray, rows: np.ndarray, columns: np.ndarray, reach: int) -> tuple[float, float]:
    """Offset (rows, columns) of the centre of a handle's depth points from its place in the mosaic, which is flat."""
    top, left = max(rows[0] - reach, 0), max(columns[0] - reach, 0)
    near = raised[top : rows[-1] + reach + 1, left : columns[-1] + reach + 1]
    if not near.any():
        return 0.0, 0.0
    down, across = (_middle(near.sum(axis=1 - k)) for k in (0, 1))
    return top + down - (rows[0] + rows[-1]) / 2, left + across - (columns[0] + columns[-1]) / 2


def _middle(points: np.ndarray) -> float:
    """Centre of the positions with a usual number of depth points: nearer ends of a handle have more points."""
    return float(np.flatnonzero(points > tuned(Params).seen * np.median(points[points > 0])).mean())
