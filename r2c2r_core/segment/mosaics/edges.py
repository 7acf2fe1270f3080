"""Colour refinement of panel edges: the innermost clear colour change near the cut."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of edge refinement by colour."""

    near_m: float = param(0.0125, "m", "Search distance for an edge on both sides of the cut")
    cut_off_m: float = param(
        0.020, "m", "Maximum error of a cut: an edge found farther off is another line", source="four cells of the odds"
    )
    least_gradient: float = param(
        1.5, "grey", "Minimum gradient, in CIELAB units per cell, of an edge on a panel without texture"
    )
    shadow_m: float = param(
        0.03, "m", "Maximum height of the shadow of a lip", source="worktops protrude 1-3 cm over fronts, lights are above"
    )
    even_shade: float = param(0.1, "share", "Maximum relative difference between the darkening of colour channels in a shadow")
    darkest_shade: float = param(0.2, "share", "Minimum fraction of light in a shadow: a gap is darker")
    least_shade: float = param(0.75, "share", "Maximum fraction of light in a shadow")
    half_gap_m: float = param(0.0015, "m", "Usual half width of a gap between fronts", source="gaps are 2-4 mm")
    widest_gap_m: float = param(0.012, "m", "Maximum apparent width of a gap, with blur")
    clear: float = param(3.5, "ratio", "Minimum gradient of an edge relative to the panel's median gradient")
    strong_share: float = param(0.45, "share", "Minimum gradient of an edge as a fraction of the strongest one nearby")
    before_m: float = param(
        0.004, "m", "Minimum mean distance of a lip in front of the plane", source="worktops protrude 1-3 cm over fronts"
    )


class Surface(NamedTuple):
    """Colour and depth of a run's plane on grid cells (rows, columns)."""

    lab: np.ndarray  # (rows, columns, 3), the mosaic's CIELAB colours
    seen: np.ndarray  # mask of the cells with colour
    height_m: np.ndarray  # mean height of depth over the plane; 0 where there is none
    points: np.ndarray  # number of depth points in that mean


class Profile(NamedTuple):
    """Profile of a panel's mosaic at each position along an axis, over the middle of its span."""

    gradient: np.ndarray  # CIELAB units per cell
    slope: np.ndarray  # of lightness, signed
    height: np.ndarray  # metres over the plane; nan where unknown

    def mirrored(self) -> "Profile":
        """Profile in reverse order, as met from the other end."""
        return Profile(self.gradient[::-1], -self.slope[::-1], self.height[::-1])


def panel_edges(cell: Cell, surface: Surface, cell_m: float) -> Cell:
    """Panel rectangle refined from its cut; an edge that would move farther than the cut may be off stays."""
    rows, columns = slice(round(cell.top), round(cell.bottom)), slice(round(cell.left), round(cell.right))
    if rows.stop - rows.start < 12 or columns.stop - columns.start < 12:
        return cell
    left, right = _ends(cell.left, cell.right, _profiles(surface, rows, axis=0), cell_m)
    across, lab = _profiles(surface, columns, axis=1), surface.lab[:, columns]
    lit, bottom = _ends(cell.top, cell.bottom, across, cell_m)
    top = _above_shadow(lit, bottom, lab, cell_m) if _lip_over(lit, across, cell_m) else lit
    cut, found = (cell.left, cell.top, cell.right, cell.bottom), (left, top, right, bottom)
    most = tuned(Params).cut_off_m / cell_m
    return Cell(*(new if abs(new - old) <= most else old for old, new in zip(cut, found, strict=True)))


def _profiles(surface: Surface, across: slice, axis: int) -> Profile:
    """Profile along an axis, over the middle of the panel's span."""
    inset = (across.stop - across.start) // 8
    middle = slice(across.start + inset, across.stop - inset)
    if axis == 0:
        colours, known, height, points = (values[middle] for values in surface)
    else:
        colours, known, height, points = (np.swapaxes(values[:, middle], 0, 1) for values in surface)
    change = np.linalg.norm(np.roll(colours, -1, axis=1) - np.roll(colours, 1, axis=1), axis=2) / 2
    slopes = (np.roll(colours[..., 0], -1, axis=1) - np.roll(colours[..., 0], 1, axis=1)) / 2
    valid = known & np.roll(known, 1, axis=1) & np.roll(known, -1, axis=1)
    count = valid.sum(axis=0)
    _, middle_change = _middles(change, valid)
    gradient = np.where(count > 0.3 * len(valid), middle_change, 0.0)
    gradient[[0, -1]] = 0
    slope = np.where(count > 0, np.mean(_middles(slopes, valid), axis=0), 0.0)
    slope[[0, -1]] = 0
    high = np.where(points.any(axis=0), (height * points).sum(axis=0) / np.maximum(points.sum(axis=0), 1e-6), np.nan)
    return Profile(np.where(np.isfinite(gradient), gradient, 0.0), slope, high)


def _middles(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Lower and upper of the two middle valid values (2, n) of each column; inf where none is valid."""
    ordered, count = np.sort(np.where(valid, values, np.inf), axis=0), valid.sum(axis=0)
    return np.take_along_axis(
        ordered, np.stack([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(values) - 1)]), axis=0
    )


def _ends(low: float, high: float, profile: Profile, cell_m: float) -> tuple[float, float]:
    """Both edges along an axis."""
    own = float(np.median(profile.gradient[round(low) + 4 : round(high) - 4]))  # of the panel's texture
    count = len(profile.gradient)
    return _end(low, profile, own, cell_m), count - _end(count - high, profile.mirrored(), own, cell_m)


def _end(low: float, profile: Profile, own: float, cell_m: float) -> float:
    """Lower edge, in positions where i + 0.5 is the middle of cell i; at the cut where none is visible."""
    params, (gradient, slope, _) = tuned(Params), profile
    least = max(params.clear * own, params.least_gradient)
    first = max(round(low - params.near_m / cell_m), 1)
    last = min(round(low + params.near_m / cell_m) + 1, len(gradient) - 1)
    peaks = _peaks(gradient[first:last], least)
    if not peaks:  # the cut followed depth, which may end before the panel does
        first, last = max(round(low - params.cut_off_m / cell_m), 1), first + 2
        peaks = _peaks(gradient[first:last], least)
    if not peaks:
        return low
    i = first + peaks[-1]  # the innermost
    gap = _gap(slope, i, max(first, i - round(params.widest_gap_m / cell_m)))
    if gap is not None:
        return (gap[0] + gap[1]) / 2 + 0.5 + params.half_gap_m / cell_m
    a, b, c = (float(value) for value in gradient[i - 1 : i + 2])
    bend = a - 2 * b + c
    offset = float(np.clip((a - c) / (2 * bend), -0.5, 0.5)) if bend < -1e-9 else 0.0
    return i + 0.5 + offset


def _lip_over(top: float, profile: Profile, cell_m: float) -> bool:
    """Whether something protrudes directly above a panel and may cast a shadow on it."""
    params, start = tuned(Params), round(top)
    over = profile.height[max(start - round(params.shadow_m / cell_m), 0) : start]
    known = over[np.isfinite(over)]
    return not len(known) or bool(np.median(known) > params.before_m)


def _above_shadow(top: float, bottom: float, lab: np.ndarray, cell_m: float) -> float:
    """Upper edge, moved up where it was found at the end of a shadow that a lip, such as a worktop's, casts on the panel.

    The shadow extends up to where the surface is no longer darkened equally in all channels, or to where it is darkest.
    """
    params = tuned(Params)
    middle = lab[:, lab.shape[1] // 8 : lab.shape[1] - lab.shape[1] // 8]
    start, reach = round(top), round(params.shadow_m / cell_m)
    below = slice(start + reach // 2, max(round((top + bottom) / 2), start + reach // 2 + 1))
    rows = np.median(middle[max(start - reach, 0) : start + reach // 2 + 1], axis=1)
    shade, unevenness = shading(rows, np.median(middle[below].reshape(-1, 3), axis=0))
    even = unevenness < params.even_shade
    first = k = start - max(start - reach, 0)
    while k > 0 and even[k - 1] and params.darkest_shade < shade[k - 1] < shade[k] - 0.005:
        k -= 1
    mixed = k
    while mixed > 0 and params.darkest_shade < shade[mixed - 1] < shade[mixed] - 0.005:
        mixed -= 1  # with the surface above the panel
    darkened = shade[k] < params.least_shade
    other = not (even & (shade > params.least_shade))[max(mixed - reach, 0) : mixed].any()
    if darkened and even[k] and other and (up := _half_way(shade[: mixed + 1])) is not None:
        return top - (first - mixed) - up
    while darkened and k > 0 and even[k - 1] and shade[k - 1] > shade[k]:
        k -= 1
    beyond = slice(max(k - reach, 0), k)
    gap = bool((even[beyond] & (shade[beyond] > params.least_shade)).any())  # between two panels of one colour
    return top - (first - k) if darkened and not gap else top


def _half_way(shade: np.ndarray) -> float | None:
    """Distance before the last, darkest position with light half way to the uneven light beyond; None where that is dark."""
    usual = float(np.median(shade[:-3])) if len(shade) > 3 else 0.0
    if usual <= shade[-1] / tuned(Params).least_shade:
        return None
    half = (usual + shade[-1]) / 2
    back = int(np.argmax(shade[::-1] >= half))
    lower, upper = float(shade[-back]), float(shade[-back - 1])
    return back - 1 + (half - lower) / (upper - lower)


def shading(lab: np.ndarray, usual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Light of colours (n, 3) relative to a reference colour (3,), and its unevenness over red, green and blue.

    A shadow darkens a surface by one factor in all channels: its unevenness is 0.
    """
    relative = _linear_light(lab) / np.maximum(_linear_light(usual[None]), 1e-3)
    shade = relative.mean(axis=1)
    return shade, np.abs(relative / np.maximum(shade, 1e-3)[:, None] - 1).max(axis=1)


def _linear_light(lab: np.ndarray) -> np.ndarray:
    """Linear light in red, green and blue, 0..1, of rows of Lab colours."""
    rgb = cv2.cvtColor(np.clip(lab, 0, 255).astype(np.uint8)[None], cv2.COLOR_LAB2RGB)[0]
    return np.asarray((rgb / 255.0) ** 2.2)


def _peaks(window: np.ndarray, least: float) -> list[int]:
    """Positions of clear peaks of the gradient."""
    least = max(least, tuned(Params).strong_share * float(window.max(initial=0.0)))
    return [
        i for i in range(1, len(window) - 1) if window[i] >= least and window[i] >= window[i - 1] and window[i] >= window[i + 1]
    ]


def _gap(slope: np.ndarray, inner: int, low: int) -> tuple[int, int] | None:
    """Outer and inner flank of a dark gap whose inner flank lies at `inner`; None when the surface beyond stays dark."""
    if slope[inner] <= 0 or inner <= low:
        return None
    outer = low + int(np.argmin(slope[low:inner]))
    return (outer, inner) if slope[outer] <= -0.4 * slope[inner] else None


def surface_of(mosaic: np.ndarray, relief: Relief) -> Surface:
    """Surface of a mosaic (rows, columns, 3) and the relief of the same plane."""
    lab, seen = as_lab(mosaic)
    height = relief.raised * relief.lift_m + (1 - relief.raised) * relief.level_m
    height, points = (
        np.repeat(np.repeat(values, STEP, axis=0), STEP, axis=1)[: lab.shape[0], : lab.shape[1]]
        for values in (height, relief.count)
    )
    return Surface(lab, seen, height, points)


def as_lab(mosaic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mosaic in Lab (float), and the mask of cells with colour."""
    seen = (mosaic[..., 0] | mosaic[..., 1] | mosaic[..., 2]) > 0  # numpy is slow along an axis of length three
    return cv2.cvtColor(mosaic, cv2.COLOR_RGB2LAB).astype(np.float32), np.asarray(seen)
