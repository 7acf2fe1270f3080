"""Strips of another material along fronts, which a cut may take for a part of them: a worktop's edge, a channel, a plinth.

A front is of one material from end to end, or framed by one on all sides. A strip at its upper or lower edge that differs from
it, is no shadow, and continues beside it, runs along the fronts and belongs to none of them.
"""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.segment.mosaics.edges import Params as EdgeParams
from r2c2r_core.segment.mosaics.edges import Surface, shading
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.tuning import param, tuned

_SOURCE = "chosen on a real kitchen, compared on ten drawn ones"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of strips of another material."""

    max_strip_m: float = param(0.08, "m", "Maximum height of a strip", gt=0, source="worktops are 20-40 mm thick, some 60")
    min_strip_m: float = param(0.008, "m", "Minimum height of a strip: lower ones are blurred gaps", gt=0, source=_SOURCE)
    min_difference: float = param(
        4.0, "σ", "Minimum difference of a strip from the panel, relative to the scatter of its rows", gt=0, source=_SOURCE
    )
    min_sigma: float = param(4.0, "grey", "Minimum scatter of the CIELAB colours of rows of one material", gt=0, source=_SOURCE)
    beside_m: float = param(
        0.06, "m", "Distance beyond the panel's sides within which a strip must continue", gt=0, source=_SOURCE
    )
    one_colour: float = param(
        0.35, "ratio", "Maximum colour difference of one strip, relative to its difference from the panel", gt=0, source=_SOURCE
    )
    side_m: float = param(0.03, "m", "Width inside the panel's sides whose colour identifies a frame", gt=0, source=_SOURCE)


def clear_of_strips(panel: Cell, surface: Surface, cell_m: float) -> Cell:
    """Panel without strips of another material along its upper and lower edge."""
    top = panel.top + _strip(panel, surface, cell_m)
    rows = len(surface.lab)
    turned = Surface(surface.lab[::-1], surface.seen[::-1], surface.height_m[::-1], surface.points[::-1])
    flipped = replace(panel, top=rows - panel.bottom, bottom=rows - panel.top)
    return replace(panel, top=top, bottom=panel.bottom - _strip(flipped, turned, cell_m))


def _strip(panel: Cell, surface: Surface, cell_m: float) -> float:
    """Height of the strip along the upper edge, grid cells; 0 where there is none."""
    params = tuned(Params)
    left, right, top, bottom = (round(edge) for edge in (panel.left, panel.right, panel.top, panel.bottom))
    reach, off = min(round(params.max_strip_m / cell_m), (bottom - top) // 4), round(params.side_m / cell_m)
    if reach < 2 or right - left < 4 * off:
        return 0.0
    rows = _rows(surface, slice(top, bottom), slice(left + off, right - off))
    seen = rows[reach:][~np.isnan(rows[reach:, 0])]
    if not len(seen):
        return 0.0
    own = np.median(seen, axis=0)
    sigma = np.maximum(1.4826 * np.median(np.abs(seen - own), axis=0), params.min_sigma)
    apart = np.linalg.norm((rows[: reach + 1] - own) / sigma, axis=1) / np.sqrt(3)
    other = (apart > params.min_difference) & ~_shaded(rows[: reach + 1], own)
    height = int(np.argmin(other)) if not other.all() else 0
    if height * cell_m < params.min_strip_m:
        return 0.0
    colour = np.median(rows[:height], axis=0)
    near = params.one_colour * float(np.linalg.norm(colour - own))
    strip, below, beside = slice(top, top + height), slice(top + 2 * height, bottom), round(params.beside_m / cell_m)
    outside = (slice(max(left - beside, 0), max(left - off // 2, 0)), slice(right + off // 2, right + beside))
    inside = (slice(left + off // 3, left + off), slice(right - off, right - off // 3))
    goes_on = any(_alike(surface, strip, columns, colour, near) for columns in outside)
    framed = all(_alike(surface, below, columns, colour, near) for columns in inside)
    return _boundary(rows, colour, own, height) if goes_on and not framed else 0.0


def _rows(surface: Surface, rows: slice, columns: slice) -> np.ndarray:
    """Median colour of each row (n, 3) over columns; NaN where unobserved. A handle covers less than half of a row."""
    lab, seen = surface.lab[rows, columns], surface.seen[rows, columns]
    found = np.full((len(lab), 3), np.nan)
    for row in np.flatnonzero(2 * seen.sum(axis=1) > seen.shape[1]):
        found[row] = np.median(lab[row][seen[row]], axis=0)
    return found


def _shaded(rows: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Mask of the rows that may be the panel's own material in a shadow: darker by one factor in red, green and blue."""
    params = tuned(EdgeParams)
    shade, unevenness = shading(np.nan_to_num(rows), own)
    even = unevenness < 2 * params.even_shade
    return np.asarray(even & (shade > params.darkest_shade) & (shade < 1 / params.least_shade))


def _alike(surface: Surface, rows: slice, columns: slice, colour: np.ndarray, near: float) -> bool:
    """Whether a patch has nearly a given colour; False where it is unobserved."""
    seen = surface.seen[rows, columns]
    if not seen.any():
        return False
    return bool(np.linalg.norm(np.median(surface.lab[rows, columns][seen], axis=0) - colour) < near)


def _boundary(rows: np.ndarray, colour: np.ndarray, own: np.ndarray, height: int) -> float:
    """Position half way between the strip's and the panel's colour, in rows from the upper edge."""
    share = (rows - colour) @ (own - colour) / max(float((own - colour) @ (own - colour)), 1e-6)
    start = max(height - 4, 0)
    beyond = np.flatnonzero(share[start : height + 4] > 0.5)
    return float(start + beyond[0]) if len(beyond) else float(height)
