"""Colour refinement of panel edges: the first clear change met from inside, near the cut or near the end of depth."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of edge refinement by colour."""

    inside_m: float = param(0.0125, "m", "Search distance for an edge inside the cut")
    outside_m: float = param(0.010, "m", "Search distance for an edge outside the cut")
    depth_short_m: float = param(
        0.04,
        "m",
        "Maximum distance by which depth may end before the panel",
        source="phones leave out 1-2 of 256 columns at an edge: 1-3 cm at 2 m",
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
    half_gap_m: float = param(0.0015, "m", "Half width of a gap, assumed where no edge is clear", source="gaps are 2-4 mm")
    widest_gap_m: float = param(0.012, "m", "Maximum apparent width of a gap, with blur")
    clear: float = param(3.5, "ratio", "Minimum gradient of an edge relative to the panel's median gradient")
    strong_share: float = param(0.45, "share", "Minimum gradient of an edge as a fraction of the strongest one nearby")
    one_colour: float = param(
        0.35,
        "ratio",
        "Maximum colour difference between both sides of a gap, relative to its lightness dip, for them to match",
        gt=0,
    )
    gap_noise: float = param(
        6.0, "σ", "Minimum lightness dip of a gap between surfaces of one colour, relative to the noise of dips in a panel"
    )
    rail_m: float = param(
        0.05,
        "m",
        "Width of the rim of a front whose dips alone may set that noise: the grain of a rail runs across its panel's",
        gt=0,
        source="frames of doors sold are 50-90 mm wide",
    )
    gap_contrast: float = param(1.5, "grey", "Minimum CIELAB lightness dip of such a gap")
    upper_face_m: float = param(
        0.02,
        "m",
        "Maximum height of a front's upper face seen in a gap above it",
        source="fronts are 16-22 mm thick, views slant by up to 45°",
    )
    channel_m: float = param(
        0.02, "m", "Maximum height of the dark part of a channel above a front", source="worktops are 20-40 mm thick"
    )
    known: float = param(
        0.3, "share", "Minimum depth points per cell, relative to the panel's median, for a cell to count as observed"
    )
    recess_m: float = param(
        0.0125, "m", "Minimum height of a recessed channel in depth", source="the smallest gap that hands reach into"
    )
    thick_m: float = param(
        0.014, "m", "Minimum thickness of fronts, and so minimum depth of a channel", source="boards of 16-22 mm"
    )
    behind_m: float = param(
        0.006, "m", "Minimum mean distance behind the plane of surface that is not the panel", source="depth of many frames"
    )
    before_m: float = param(
        0.004, "m", "Minimum mean distance of a lip in front of the plane", source="worktops protrude 1-3 cm over fronts"
    )
    depth_off_m: float = param(
        0.005, "m", "Position error along the plane of depth from many frames", source="a cell of the relief"
    )


class Surface(NamedTuple):
    """Colour and depth of a run's plane on grid cells (rows, columns)."""

    lab: np.ndarray  # (rows, columns, 3), the mosaic's CIELAB colours
    seen: np.ndarray  # mask of the cells with colour
    height_m: np.ndarray  # mean height of depth over the plane; 0 where there is none
    points: np.ndarray  # number of depth points in that mean
    seams: PanelOdds | None = None  # log-odds of the network on it

    def shows(self, cell: Cell) -> tuple[bool, bool, bool, bool]:
        """Flags of a panel's edges (left, right, top, bottom) that the network sees at the cut, more likely than not."""
        if self.seams is None:
            return False, False, False, False
        left, right, top, bottom = self.seams.of_edges(cell)
        return left > 0, right > 0, top > 0, bottom > 0


class Profile(NamedTuple):
    """Profile of a panel's mosaic at each position along an axis, over the middle of its span."""

    gradient: np.ndarray  # CIELAB units per cell
    slope: np.ndarray  # of lightness, signed
    light: np.ndarray  # relative luminance, 0..1; nan where unknown
    height: np.ndarray  # metres over the plane; nan where unknown
    points: np.ndarray  # depth points per cell
    lab: np.ndarray  # mean CIELAB colours, (positions, 3)

    def mirrored(self) -> "Profile":
        """Profile in reverse order, as met from the other end."""
        return Profile(
            self.gradient[::-1],
            -self.slope[::-1],
            self.light[::-1],
            self.height[::-1],
            self.points[::-1],
            self.lab[::-1],
        )


def panel_edges(cell: Cell, surface: Surface, cell_m: float) -> Cell:
    """Panel rectangle refined from its cut."""
    rows, columns = slice(round(cell.top), round(cell.bottom)), slice(round(cell.left), round(cell.right))
    if rows.stop - rows.start < 12 or columns.stop - columns.start < 12:
        return cell
    seen = surface.shows(cell)
    left, right = _ends(cell.left, cell.right, seen[:2], _profiles(surface, rows, axis=0), cell_m)
    across, lab = _profiles(surface, columns, axis=1), surface.lab[:, columns]
    lit, bottom = _ends(cell.top, cell.bottom, seen[2:], across, cell_m)
    top = _above_shadow(lit, bottom, lab, cell_m) if _lip_over(lit, across, cell_m) else lit
    return Cell(left, top, right, bottom)


def _profiles(surface: Surface, across: slice, axis: int) -> Profile:
    """Profile along an axis, over the middle of the panel's span."""
    inset = (across.stop - across.start) // 8
    middle = slice(across.start + inset, across.stop - inset)
    if axis == 0:
        colours, known, height, points = (values[middle] for values in surface[:4])
    else:
        colours, known, height, points = (np.swapaxes(values[:, middle], 0, 1) for values in surface[:4])
    change = np.linalg.norm(np.roll(colours, -1, axis=1) - np.roll(colours, 1, axis=1), axis=2) / 2
    slopes = (np.roll(colours[..., 0], -1, axis=1) - np.roll(colours[..., 0], 1, axis=1)) / 2
    valid = known & np.roll(known, 1, axis=1) & np.roll(known, -1, axis=1)
    count = valid.sum(axis=0)
    _, middle_change = _middles(change, valid)
    gradient = np.where(count > 0.3 * len(valid), middle_change, 0.0)
    gradient[[0, -1]] = 0
    slope = np.where(count > 0, np.mean(_middles(slopes, valid), axis=0), 0.0)
    slope[[0, -1]] = 0
    light = np.where(count > 0, _luminance(np.mean(_middles(colours[..., 0], valid), axis=0)), np.nan)
    high = np.where(points.any(axis=0), (height * points).sum(axis=0) / np.maximum(points.sum(axis=0), 1e-6), np.nan)
    lab = np.where(known[..., None], colours, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)[:, None]
    return Profile(np.where(np.isfinite(gradient), gradient, 0.0), slope, light, high, points.mean(axis=0), lab)


def _middles(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Lower and upper of the two middle valid values (2, n) of each column; inf where none is valid."""
    ordered, count = np.sort(np.where(valid, values, np.inf), axis=0), valid.sum(axis=0)
    return np.take_along_axis(
        ordered, np.stack([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(values) - 1)]), axis=0
    )


def _ends(low: float, high: float, seen: tuple[bool, bool], profile: Profile, cell_m: float) -> tuple[float, float]:
    """Both edges along an axis; `seen` flags those that the network sees at the cut."""
    own = _own(low, high, profile)
    count = len(profile.gradient)
    last = _end(count - high, count - low, seen[1], profile.mirrored(), own, cell_m)
    return _end(low, high, seen[0], profile, own, cell_m), count - last


def _own(low: float, high: float, profile: Profile) -> float:
    """Median gradient inside the panel."""
    return float(np.median(profile.gradient[round(low) + 4 : round(high) - 4]))


def _end(low: float, high: float, seen: bool, profile: Profile, own: float, cell_m: float) -> float:
    """Lower edge, in positions where i + 0.5 is the middle of cell i; at the cut where none is visible."""
    params, (gradient, slope, light, *_) = tuned(Params), profile
    start = low + _dark_from(round(low), round((low + high) / 2), light, cell_m)
    least = max(params.clear * own, params.least_gradient)
    begins = _plane_from(low, high, profile, cell_m)
    if begins is not None:
        return _step_near(*begins, gradient, least, cell_m)
    first = max(round(low - params.outside_m / cell_m), 1)
    last = min(round(start + params.inside_m / cell_m) + 1, len(gradient) - 1)
    while last - first > 3 and gradient[last - 1] > gradient[last - 2]:
        last -= 1  # the flank of an edge farther inside
    peaks = _peaks(gradient[first:last], least)
    own_gap = _gap_in_one_colour(profile, start, high, last, cell_m)
    if own_gap is not None:
        peaks = [*peaks, own_gap - first]
    if not peaks and seen:
        return low
    if not peaks:  # the cut followed depth, which ends before the panel does
        first, last = max(round(low - params.depth_short_m / cell_m), 1), first + 2
        peaks = [i for i in _peaks(gradient[first:last], least) if not _is_behind(first + i, round(low), round(high), profile)]
    if not peaks:
        return start + (params.half_gap_m / cell_m if start == low else 0.0)
    i = peaks[-1]  # the innermost
    gap = _gap(slope, first + i, max(first, first + i - round(params.widest_gap_m / cell_m)))
    if gap is not None:
        return (gap[0] + gap[1]) / 2 + 0.5 + max(params.half_gap_m / cell_m, _dark_width(light, *gap, cell_m) / 2)
    a, b, c = (float(value) for value in gradient[first + i - 1 : first + i + 2])
    bend = a - 2 * b + c
    offset = float(np.clip((a - c) / (2 * bend), -0.5, 0.5)) if bend < -1e-9 else 0.0
    return first + i + 0.5 + offset


def _is_behind(start: int, low: int, high: int, profile: Profile) -> bool:
    """Whether depth shows the surface before a panel, from `start` to its cut at `low`, behind its plane."""
    params, strip = tuned(Params), slice(start, low)
    points = profile.points[strip]
    if points.sum() <= params.known * float(np.median(profile.points[low:high])):
        return False
    height = np.nansum(profile.height[strip] * points) / points.sum() - _median_seen(profile.height[low:high])
    return bool(height < -params.behind_m)


def _gap_in_one_colour(profile: Profile, low: float, high: float, last: int, cell_m: float) -> int | None:
    """Inner flank of the innermost gap with the same colour on both sides, from a cut at `low` on; None where there is none.

    A front is one board: beyond such a gap its face frame or another front begins, even if that one's end is clearer.
    """
    params, half = tuned(Params), round(tuned(Params).widest_gap_m / 2 / cell_m)
    lab, (before, after) = profile.lab, _beside(profile.lab, half + 1)
    middle = (lab[:-2, 0] + lab[1:-1, 0] + lab[2:, 0]) / 3
    dip = np.pad(np.minimum(before[1:-1, 0], after[1:-1, 0]) - middle, 1)
    differ = np.linalg.norm(before - after, axis=1)
    first, beyond = round(low) + 4, round(high) - 4
    inside = (dip[first:beyond], dip[first : min(first + round(params.rail_m / cell_m), beyond)])
    noise = 1.4826 * max(float(np.median(np.abs(part))) for part in inside)
    least = max(params.gap_noise * noise, params.gap_contrast)
    for at in range(last, max(round(low), half) - 1, -1):  # nearer to the mosaic's end, one side is not seen
        if dip[at] > least and differ[at] < params.one_colour * dip[at] and dip[at] == dip[at - half : at + half + 1].max():
            return at + int(np.argmax(profile.slope[at : at + half]))
    return None


def _beside(values: np.ndarray, off: int) -> np.ndarray:
    """Means of two positions (2, n, channels) `off` before and after each position; edge values beyond the ends."""
    padded = np.pad(values, ((off, off), (0, 0)), mode="edge")
    pairs = (padded[:-1] + padded[1:]) / 2
    count = len(values)
    return np.stack([pairs[:count], pairs[-count:]])


def _median_seen(values: np.ndarray) -> float:
    """Median of the observed values; NaN where there are none."""
    seen = values[~np.isnan(values)]
    return float(np.median(seen)) if len(seen) else float("nan")


def _dark_from(first: int, last: int, light: np.ndarray, cell_m: float) -> float:
    """Extent of a gap into a panel whose cut lies on the gap's other side."""
    params = tuned(Params)
    near = light[first : first + round(params.upper_face_m / cell_m)] < params.darkest_shade * _median_seen(light[first:last])
    begins = int(np.argmax(near))
    inside = np.flatnonzero(~near[begins:])
    return float(begins + inside[0]) if near[:3].any() and len(inside) else 0.0


def _plane_from(low: float, high: float, profile: Profile, cell_m: float) -> tuple[int, int] | None:
    """Range of positions in which depth shows a panel to begin beside a recessed channel; None without a channel.

    A channel is a strip behind the plane, between two on it. Cameras above see its surface lower than it would be on the plane:
    the part of the channel under the front above has no depth.
    """
    params, first = tuned(Params), round(low)
    inside = slice(first, round(high))
    height = profile.height - _median_seen(profile.height[inside])
    known = profile.points > params.known * float(np.median(profile.points[inside]))
    reach = round(params.channel_m / cell_m)
    start, stop = max(first - 2 * reach, 0), min(first + reach, round((low + high) / 2))
    behind = start + np.flatnonzero((known & (height < -params.behind_m))[start:stop])
    if len(behind) * cell_m < params.recess_m or height[behind].min() > -params.thick_m:
        return None
    beyond = slice(max(int(behind[0]) - reach, 0), int(behind[0]))
    on_plane, ends = known & (height > -params.behind_m / 2), int(behind[-1]) + 1
    if not on_plane[beyond].any():
        return None
    return ends, ends + int(np.argmax(on_plane[ends : ends + reach]))


def _step_near(earliest: int, latest: int, gradient: np.ndarray, least: float, cell_m: float) -> float:
    """Innermost clear colour step near where depth shows a panel to begin, or else the clearest one there."""
    params = tuned(Params)
    off = round(params.depth_off_m / cell_m)
    first, last = earliest - off, latest + off + 1
    peaks = _peaks(gradient[first - 1 : last + 1], least)
    return (first - 1 + peaks[-1] if peaks else first + int(np.argmax(gradient[first:last]))) + 0.5


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
    shade, unevenness = _shading(rows, np.median(middle[below].reshape(-1, 3), axis=0))
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


def _shading(lab: np.ndarray, usual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


def _dark_width(light: np.ndarray, outer: int, inner: int, cell_m: float) -> float:
    """Width in positions of a lightless gap that would be as dark in total as the blurred one between two flanks."""
    around = round(tuned(Params).half_gap_m / cell_m) + 2
    low, high = max(outer - around, 0), inner + around + 1
    beside = min(float(np.nanmax(side, initial=1e-3)) for side in (light[low : outer + 1], light[inner:high]))
    return float(np.nansum(np.clip(1 - light[low:high] / beside, 0, None)))


def _luminance(lightness: np.ndarray) -> np.ndarray:
    """Relative luminance 0..1 of OpenCV's 8-bit CIELAB lightness."""
    return np.asarray(((np.asarray(lightness) * (100 / 255) + 16) / 116) ** 3)


def surface_of(mosaic: np.ndarray, relief: Relief, seams: PanelOdds) -> Surface:
    """Surface of a mosaic (rows, columns, 3), the relief of the same plane and the network's log-odds."""
    lab, seen = as_lab(mosaic)
    height = relief.raised * relief.lift_m + (1 - relief.raised) * relief.level_m
    height, points = (
        np.repeat(np.repeat(values, STEP, axis=0), STEP, axis=1)[: lab.shape[0], : lab.shape[1]]
        for values in (height, relief.count)
    )
    return Surface(lab, seen, height, points, seams)


def as_lab(mosaic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mosaic in Lab (float), and the mask of cells with colour."""
    seen = (mosaic[..., 0] | mosaic[..., 1] | mosaic[..., 2]) > 0  # numpy is slow along an axis of length three
    return cv2.cvtColor(mosaic, cv2.COLOR_RGB2LAB).astype(np.float32), np.asarray(seen)
