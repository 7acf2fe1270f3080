"""Handle detection on panels: what the panel network takes for one, and how far depth saw it stand out."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.segment.runs.orthomosaic import STEP, Cell
from r2c2r_core.segment.runs.panel_net import PanelOdds
from r2c2r_core.segment.runs.relief import Relief
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What on a panel is its handle."""

    parted_m: float = param(0.04, "m", "between parts of one handle", source="glare parts bars, a cup pull's rim its middle")


@dataclass(frozen=True, slots=True, kw_only=True)
class GridHandle:
    """A handle in grid cells, with a confidence 0..1."""

    left: float
    top: float
    right: float
    bottom: float
    confidence: float
    protrusion_m: float = 0.0  # 0: not measured

    @property
    def width(self) -> float:
        """In grid cells."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """In grid cells."""
        return self.bottom - self.top


def find_handle(odds: PanelOdds, relief: Relief, cell: Cell) -> GridHandle | None:
    """The likeliest handle of a panel; None where the network sees none."""
    top, bottom, left, right = (max(round(edge / STEP), 0) for edge in (cell.top, cell.bottom, cell.left, cell.right))
    panel = odds.handle[top:bottom, left:right]
    area = (slice(top, top + panel.shape[0]), slice(left, left + panel.shape[1]))
    if panel.size == 0 or panel.max() <= 0:
        return None
    size = 2 * round(tuned(Params).parted_m / relief.cell_m / 2) + 1
    likely = (panel > 0).astype(np.uint8)
    closed = cv2.morphologyEx(likely, cv2.MORPH_CLOSE, np.ones((size, size), np.uint8))
    labels = np.where(likely > 0, cv2.connectedComponents(closed)[1], 0)
    inside = labels == np.bincount(labels.ravel(), np.maximum(panel, 0).ravel()).argmax()
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    weight = (relief.count * relief.raised)[area][inside]
    return GridHandle(
        left=float(left + columns[0]) * STEP,
        top=float(top + rows[0]) * STEP,
        right=float(left + columns[-1] + 1) * STEP,
        bottom=float(top + rows[-1] + 1) * STEP,
        protrusion_m=float(np.average(relief.lift_m[area][inside], weights=weight)) if weight.sum() > 0 else 0.0,
        confidence=float(1 / (1 + np.exp(-panel[inside].mean()))),
    )
