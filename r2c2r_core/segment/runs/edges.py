"""Panel edges refined by colour: the first clear change met from inside, near the cut or where depth ends."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How a cut is refined by colour."""

    inside_m: float = param(0.010, "m", "inside the cut, where an edge is looked for")
    outside_m: float = param(0.010, "m", "outside the cut, where an edge is looked for")
    depth_ends_m: float = param(0.008, "m", "depth that stops this far short of the cut moves the search there")
    half_gap_m: float = param(0.0015, "m", "half a gap, assumed where no edge is clear", source="gaps are 2-4 mm")
    widest_gap_m: float = param(0.012, "m", "of a gap, as blurred as it looks")
    clear: float = param(3.5, "ratio", "to the panel's own median gradient, of an edge")
    strong_share: float = param(0.45, "share", "of the strongest gradient nearby, of an edge")


def panel_edges(cell: Cell, lab: np.ndarray, seen: np.ndarray, on_plane: np.ndarray, cell_m: float) -> Cell:
    """The panel's rectangle: `lab` is the mosaic, `seen` where it has colour, `on_plane` where depth saw the plane."""
    rows, columns = slice(round(cell.top), round(cell.bottom)), slice(round(cell.left), round(cell.right))
    if rows.stop - rows.start < 12 or columns.stop - columns.start < 12:
        return cell
    left, right = _ends(cell.left, cell.right, *_profiles(lab, seen, on_plane, rows, axis=0), cell_m)
    top, bottom = _ends(cell.top, cell.bottom, *_profiles(lab, seen, on_plane, columns, axis=1), cell_m)
    return Cell(left, top, right, bottom)


def _profiles(
    lab: np.ndarray, seen: np.ndarray, on_plane: np.ndarray, across: slice, axis: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gradient, signed lightness slope and depth support at each position, over the middle of the panel's span."""
    inset = (across.stop - across.start) // 8
    middle = slice(across.start + inset, across.stop - inset)
    if axis == 0:
        colours, known, support = lab[middle], seen[middle], on_plane[middle]
    else:
        colours, known, support = lab[:, middle].transpose(1, 0, 2), seen[:, middle].T, on_plane[:, middle].T
    change = np.linalg.norm(np.roll(colours, -1, axis=1) - np.roll(colours, 1, axis=1), axis=2) / 2
    slopes = (np.roll(colours[..., 0], -1, axis=1) - np.roll(colours[..., 0], 1, axis=1)) / 2
    valid = known & np.roll(known, 1, axis=1) & np.roll(known, -1, axis=1)
    count = valid.sum(axis=0)
    ordered = np.sort(np.where(valid, change, np.inf), axis=0)
    at = np.clip(count // 2, 0, max(len(ordered) - 1, 0))
    gradient = np.where(count > 0.3 * len(ordered), np.take_along_axis(ordered, at[None], axis=0)[0], 0.0)
    gradient[[0, -1]] = 0
    slope = np.ma.median(np.ma.array(slopes, mask=~valid), axis=0).filled(0.0)
    slope[[0, -1]] = 0
    return np.where(np.isfinite(gradient), gradient, 0.0), slope, support.mean(axis=0)


def _ends(
    low: float, high: float, gradient: np.ndarray, slope: np.ndarray, support: np.ndarray, cell_m: float
) -> tuple[float, float]:
    own = float(np.median(gradient[round(low) + 4 : round(high) - 4]))
    first = _end(low, high, gradient, slope, support, own, cell_m)
    mirrored = _end(len(gradient) - high, len(gradient) - low, gradient[::-1], -slope[::-1], support[::-1], own, cell_m)
    return first, len(gradient) - mirrored


def _end(
    low: float, high: float, gradient: np.ndarray, slope: np.ndarray, support: np.ndarray, own: float, cell_m: float
) -> float:
    """The lower edge, in positions where i + 0.5 is the middle of cell i."""
    params = tuned(Params)
    usual = float(np.median(support[round(low) : round(high)]))
    covered = np.flatnonzero(support[round(low) : round((low + high) / 2)] > 0.4 * usual)
    start = low
    if usual > 0.2 and len(covered) and covered[0] * cell_m > params.depth_ends_m:
        start = low + float(covered[0])  # the cut followed a shadow or an edge of something beside the panel
    first = max(round(start - params.outside_m / cell_m), 1)
    last = min(round(start + params.inside_m / cell_m) + 1, len(gradient) - 1)
    window = gradient[first:last]
    if len(window) < 3 or window.max() < params.clear * own + 0.5:
        return start + (params.half_gap_m / cell_m if start == low else 0.0)
    clear = window >= max(params.strong_share * window.max(), params.clear * own)
    peaks = [i for i in range(1, len(window) - 1) if clear[i] and window[i] >= window[i - 1] and window[i] >= window[i + 1]]
    if not peaks:
        return start + (params.half_gap_m / cell_m if start == low else 0.0)
    i = peaks[-1]  # the innermost
    gap = _gap_centre(slope[first:last], i, round(params.widest_gap_m / cell_m))
    if gap is not None:
        return first + gap + 0.5 + params.half_gap_m / cell_m
    a, b, c = (float(value) for value in window[i - 1 : i + 2])
    bend = a - 2 * b + c
    offset = float(np.clip((a - c) / (2 * bend), -0.5, 0.5)) if bend < -1e-9 else 0.0
    return first + i + 0.5 + offset


def _gap_centre(slope: np.ndarray, inner: int, reach: int) -> float | None:
    """The middle of a dark gap whose inner flank lies at `inner`; None when what is beyond stays dark."""
    if slope[inner] <= 0:
        return None
    low = max(inner - reach, 0)
    outer = low + int(np.argmin(slope[low:inner])) if inner > low else inner
    if outer == inner or slope[outer] > -0.4 * slope[inner]:
        return None
    return (outer + inner) / 2


def as_lab(mosaic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The mosaic in Lab (float), and where it has colour."""
    return cv2.cvtColor(mosaic, cv2.COLOR_RGB2LAB).astype(np.float32), np.asarray(mosaic.any(axis=2))
