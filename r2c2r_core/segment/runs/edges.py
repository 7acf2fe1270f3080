"""Panel edges refined by colour: the first clear change met from inside, near the cut or where depth ends."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How a cut is refined by colour."""

    inside_m: float = param(0.0125, "m", "inside the cut, where an edge is looked for")
    outside_m: float = param(0.010, "m", "outside the cut, where an edge is looked for")
    depth_ends_m: float = param(0.008, "m", "depth that stops this far short of the cut moves the search there")
    depth_short_m: float = param(
        0.04,
        "m",
        "by which depth may end before the panel",
        source="phones leave out 1-2 of 256 columns at an edge: 1-3 cm at 2 m",
    )
    least_gradient: float = param(1.5, "grey", "CIELAB units a cell, of an edge on a panel without texture")
    shadow_m: float = param(
        0.03, "m", "height of the shadow of a lip", source="worktops stand 1-3 cm over fronts, lights are above"
    )
    even_shade: float = param(0.1, "share", "by which colours may be darkened unequally in a shadow")
    darkest_shade: float = param(0.2, "share", "of the light that a shadow leaves: a gap is darker")
    least_shade: float = param(0.75, "share", "of the light in what is a shadow")
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
    return Cell(left, _above_shadow(top, bottom, lab[:, columns], cell_m), right, bottom)


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
    _, middle = _middles(change, valid)
    gradient = np.where(count > 0.3 * len(valid), middle, 0.0)
    gradient[[0, -1]] = 0
    slope = np.where(count > 0, np.mean(_middles(slopes, valid), axis=0), 0.0)
    slope[[0, -1]] = 0
    return np.where(np.isfinite(gradient), gradient, 0.0), slope, support.mean(axis=0)


def _middles(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """The lower and the upper of the two middle values (2, n) of what is valid of each column; inf where nothing is."""
    ordered, count = np.sort(np.where(valid, values, np.inf), axis=0), valid.sum(axis=0)
    return np.take_along_axis(
        ordered, np.stack([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(values) - 1)]), axis=0
    )


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
    least = max(params.clear * own, params.least_gradient)
    first = max(round(low - params.outside_m / cell_m), 1)
    last = min(round(start + params.inside_m / cell_m) + 1, len(gradient) - 1)
    while last - first > 3 and gradient[last - 1] > gradient[last - 2]:
        last -= 1  # the flank of what lies farther in
    peaks = _peaks(gradient[first:last], least)
    if not peaks:  # the cut followed depth, which ends before the panel does
        first, last = max(round(low - params.depth_short_m / cell_m), 1), first + 2
        peaks = _peaks(gradient[first:last], least)
    if not peaks:
        return start + (params.half_gap_m / cell_m if start == low else 0.0)
    window = gradient[first:last]
    i = peaks[-1]  # the innermost
    gap = _gap_centre(slope[first:last], i, round(params.widest_gap_m / cell_m))
    if gap is not None:
        return first + gap + 0.5 + params.half_gap_m / cell_m
    a, b, c = (float(value) for value in window[i - 1 : i + 2])
    bend = a - 2 * b + c
    offset = float(np.clip((a - c) / (2 * bend), -0.5, 0.5)) if bend < -1e-9 else 0.0
    return first + i + 0.5 + offset


def _above_shadow(top: float, bottom: float, lab: np.ndarray, cell_m: float) -> float:
    """The upper edge, moved up where what it follows is the end of a shadow that a lip, as a worktop's, throws on the panel.

    In shadow a surface is darker by one factor in all colours: up to where that stops being so, or it is darkest.
    """
    params = tuned(Params)
    middle = lab[:, lab.shape[1] // 8 : lab.shape[1] - lab.shape[1] // 8]
    start, reach = round(top), round(params.shadow_m / cell_m)
    below = slice(start + reach // 2, max(round((top + bottom) / 2), start + reach // 2 + 1))
    light = _linear(np.median(middle[max(start - reach, 0) : start + reach // 2 + 1], axis=1))
    relative = light / np.maximum(_linear(np.median(middle[below].reshape(-1, 3), axis=0)[None]), 1e-3)
    shade = relative.mean(axis=1)
    even = np.abs(relative / np.maximum(shade, 1e-3)[:, None] - 1).max(axis=1) < params.even_shade
    first = k = start - max(start - reach, 0)
    while k > 0 and even[k - 1] and params.darkest_shade < shade[k - 1] < shade[k] - 0.005:
        k -= 1
    darkened = shade[k] < params.least_shade
    while darkened and k > 0 and even[k - 1] and shade[k - 1] > shade[k]:
        k -= 1
    beyond = slice(max(k - reach, 0), k)
    gap = bool((even[beyond] & (shade[beyond] > params.least_shade)).any())  # between two panels of one colour
    return top - (first - k) if darkened and not gap else top


def _linear(lab: np.ndarray) -> np.ndarray:
    """Linear light in red, green and blue, 0..1, of rows of colours."""
    rgb = cv2.cvtColor(np.clip(lab, 0, 255).astype(np.uint8)[None], cv2.COLOR_LAB2RGB)[0]
    return np.asarray((rgb / 255.0) ** 2.2)


def _peaks(window: np.ndarray, least: float) -> list[int]:
    """Where the gradient has clear peaks."""
    least = max(least, tuned(Params).strong_share * float(window.max(initial=0.0)))
    return [
        i for i in range(1, len(window) - 1) if window[i] >= least and window[i] >= window[i - 1] and window[i] >= window[i + 1]
    ]


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
