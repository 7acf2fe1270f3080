"""Panel edges refined by colour: the first clear change met from inside, near the cut or where depth ends."""

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
    """How a cut is refined by colour."""

    inside_m: float = param(0.0125, "m", "inside the cut, where an edge is looked for")
    outside_m: float = param(0.010, "m", "outside the cut, where an edge is looked for")
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
    one_colour: float = param(
        0.35, "ratio", "to the depth of a gap, by which colours may differ from one side of it to the other", gt=0
    )
    gap_noise: float = param(6.0, "σ", "of dips within a panel, of a gap between surfaces of one colour")
    rail_m: float = param(
        0.05,
        "m",
        "of a front inside its edge, whose dips count alone too: the grain of a frame's rail runs across that of its panel",
        gt=0,
        source="frames of doors sold are 50-90 mm wide",
    )
    gap_contrast: float = param(1.5, "grey", "CIELAB units by which such a gap is darker, at least")
    upper_face_m: float = param(
        0.02,
        "m",
        "of a front's upper face, seen in a gap over it",
        source="fronts are 16-22 mm thick, views slant by up to 45°",
    )
    channel_m: float = param(
        0.02, "m", "of what is dark of a channel over a front, at most", source="worktops are 20-40 mm thick"
    )
    open_gap_m: float = param(0.004, "m", "of a gap wide enough to see into", source="gaps between fronts are 2-4 mm")
    open_dark: float = param(
        0.5,
        "share",
        "of the light that is missing in such a gap, at least",
        gt=0,
        source="development kitchens: 0.2 to 0.4 in shadows of worktops on fronts as white as they",
    )
    known: float = param(0.3, "share", "of the panel's depth points, of what depth sees")
    recess_m: float = param(0.0125, "m", "of a recessed channel as depth shows it", source="the least that hands reach into")
    thick_m: float = param(0.014, "m", "of fronts at least, and so the depth of a channel", source="boards of 16-22 mm")
    behind_m: float = param(0.006, "m", "behind the plane, on average, of what is not the panel", source="depth of many frames")
    lip_m: float = param(0.06, "m", "of a lip's height, at most", gt=0, source="worktops are 20-40 mm thick, some 60")
    before_m: float = param(0.004, "m", "before the plane, on average, of a lip", source="worktops stand 1-3 cm over fronts")
    depth_off_m: float = param(
        0.005, "m", "by which depth of many frames is off along the plane", source="a cell of the relief"
    )


class Surface(NamedTuple):
    """What a run shows of its plane, on grid cells (rows, columns)."""

    lab: np.ndarray  # (rows, columns, 3), the mosaic's CIELAB colours
    seen: np.ndarray  # where it has colour
    height_m: np.ndarray  # mean height of depth over the plane; 0 where there is none
    points: np.ndarray  # of depth that the mean is of
    seams: PanelOdds | None = None  # what the network sees in it

    def shows(self, cell: Cell) -> tuple[bool, bool, bool, bool]:
        """Which edges of a panel the network sees where it was cut, more likely than not: left, right, top, bottom."""
        if self.seams is None:
            return False, False, False, False
        left, right, top, bottom = self.seams.of_edges(cell)
        return left > 0, right > 0, top > 0, bottom > 0


class Profile(NamedTuple):
    """What a panel's mosaic shows at each position along an axis, over the middle of its span."""

    gradient: np.ndarray  # CIELAB units a cell
    slope: np.ndarray  # of lightness, signed
    light: np.ndarray  # relative luminance, 0..1; nan where nothing is known
    height: np.ndarray  # metres over the plane; nan where nothing is known
    points: np.ndarray  # of depth, in a cell
    lab: np.ndarray  # mean CIELAB colours, (positions, 3)

    def mirrored(self) -> "Profile":
        """As met from the other end."""
        return Profile(
            self.gradient[::-1],
            -self.slope[::-1],
            self.light[::-1],
            self.height[::-1],
            self.points[::-1],
            self.lab[::-1],
        )


class Refined(NamedTuple):
    """A panel as refined from where it was cut."""

    panel: Cell
    lit_top: float  # its upper edge, or, where that lies in a shadow of a lip, where the shadow ends on it
    shown: tuple[bool, bool, bool, bool] = (True, True, True, True)  # left, right, top, bottom: or where it was cut


def panel_edges(cell: Cell, surface: Surface, cell_m: float) -> Refined:
    """The panel's rectangle, refined from where it was cut."""
    rows, columns = slice(round(cell.top), round(cell.bottom)), slice(round(cell.left), round(cell.right))
    if rows.stop - rows.start < 12 or columns.stop - columns.start < 12:
        return Refined(cell, cell.top, shown=(False, False, False, False))
    seen = surface.shows(cell)
    (left, right), beside = _ends(cell.left, cell.right, seen[:2], _profiles(surface, rows, axis=0), cell_m)
    across, lab = _profiles(surface, columns, axis=1), surface.lab[:, columns]
    (lit, bottom), upright = _ends(cell.top, cell.bottom, seen[2:], across, cell_m)
    shown, lit = (*beside, *upright), _under_lip(lit, bottom, across, _rim(surface, rows, columns), cell_m)
    below = _below_upper_face(lit, bottom, across, lab, cell_m)
    if below is not None:
        return Refined(Cell(left, below, right, bottom), below, shown)
    top = _above_shadow(lit, bottom, lab, cell_m) if _lip_over(lit, across, cell_m) else lit
    return Refined(Cell(left, top, right, bottom), lit, shown)


def _profiles(surface: Surface, across: slice, axis: int) -> Profile:
    """Along an axis, over the middle of the panel's span."""
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
    """The lower and the upper of the two middle values (2, n) of what is valid of each column; inf where nothing is."""
    ordered, count = np.sort(np.where(valid, values, np.inf), axis=0), valid.sum(axis=0)
    return np.take_along_axis(
        ordered, np.stack([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(values) - 1)]), axis=0
    )


def _ends(
    low: float, high: float, seen: tuple[bool, bool], profile: Profile, cell_m: float
) -> tuple[tuple[float, float], tuple[bool, bool]]:
    """Both edges along an axis, and whether each shows; `seen`: by the network, where it was cut."""
    count = len(profile.gradient)
    own = _own(low, high, profile)
    first, begins = _end(low, high, seen[0], profile, own, cell_m)
    last, ends = _end(count - high, count - low, seen[1], profile.mirrored(), own, cell_m)
    return (first, count - last), (begins, ends)


def _own(low: float, high: float, profile: Profile) -> float:
    """The panel's own median gradient."""
    return float(np.median(profile.gradient[round(low) + 4 : round(high) - 4]))


def _end(low: float, high: float, seen: bool, profile: Profile, own: float, cell_m: float) -> tuple[float, bool]:
    """The lower edge, in positions where i + 0.5 is the middle of cell i, and whether it shows or is where it was cut."""
    params, (gradient, slope, light, *_) = tuned(Params), profile
    start = low + _dark_from(round(low), round((low + high) / 2), light, cell_m)
    least = max(params.clear * own, params.least_gradient)
    begins = _plane_from(low, high, profile, cell_m)
    if begins is not None:
        return _step_near(*begins, gradient, least, cell_m), True
    first = max(round(low - params.outside_m / cell_m), 1)
    last = min(round(start + params.inside_m / cell_m) + 1, len(gradient) - 1)
    while last - first > 3 and gradient[last - 1] > gradient[last - 2]:
        last -= 1  # the flank of what lies farther in
    peaks = _peaks(gradient[first:last], least)
    own_gap = _gap_in_one_colour(profile, start, high, last, cell_m)
    if own_gap is not None:
        peaks = [*peaks, own_gap - first]
    if not peaks and seen:
        return low, True
    if not peaks:  # the cut followed depth, which ends before the panel does
        first, last = max(round(low - params.depth_short_m / cell_m), 1), first + 2
        peaks = [i for i in _peaks(gradient[first:last], least) if not _is_behind(first + i, round(low), round(high), profile)]
    if not peaks:
        return start + (params.half_gap_m / cell_m if start == low else 0.0), False
    window = gradient[first:last]
    i = peaks[-1]  # the innermost
    gap = _gap(slope, first + i, max(first, first + i - round(params.widest_gap_m / cell_m)))
    if gap is not None:
        return (gap[0] + gap[1]) / 2 + 0.5 + max(params.half_gap_m / cell_m, _dark_width(light, *gap, cell_m) / 2), True
    a, b, c = (float(value) for value in window[i - 1 : i + 2])
    bend = a - 2 * b + c
    offset = float(np.clip((a - c) / (2 * bend), -0.5, 0.5)) if bend < -1e-9 else 0.0
    return first + i + 0.5 + offset, True


def _is_behind(start: int, low: int, high: int, profile: Profile) -> bool:
    """Whether depth shows what lies before a panel, from `start` to its cut at `low`, to be behind its plane."""
    params, strip = tuned(Params), slice(start, low)
    points = profile.points[strip]
    if points.sum() <= params.known * float(np.median(profile.points[low:high])):
        return False
    height = np.nansum(profile.height[strip] * points) / points.sum() - _median_seen(profile.height[low:high])
    return bool(height < -params.behind_m)


def _gap_in_one_colour(profile: Profile, low: float, high: float, last: int, cell_m: float) -> int | None:
    """The inner flank of the innermost gap with the same colour on both sides, from a cut at `low` on; None where none is.

    A front is one board: beyond such a gap its face frame, or another front, begins, however much clearer that one's end is.
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
    for at in range(last, round(low) - 1, -1):
        if dip[at] > least and differ[at] < params.one_colour * dip[at] and dip[at] == dip[at - half : at + half + 1].max():
            return at + int(np.argmax(profile.slope[at : at + half]))
    return None


def _beside(values: np.ndarray, off: int) -> np.ndarray:
    """Means of two positions (2, n, channels) that far before and after each; the border's beyond the ends."""
    padded = np.pad(values, ((off, off), (0, 0)), mode="edge")
    pairs = (padded[:-1] + padded[1:]) / 2
    count = len(values)
    return np.stack([pairs[:count], pairs[-count:]])


def _median_seen(values: np.ndarray) -> float:
    """The median of what some frame shows; not a number where nothing is."""
    seen = values[~np.isnan(values)]
    return float(np.median(seen)) if len(seen) else float("nan")


def _dark_from(first: int, last: int, light: np.ndarray, cell_m: float) -> float:
    """How far a gap reaches into a panel whose cut lies on the gap's other side."""
    params = tuned(Params)
    near = light[first : first + round(params.upper_face_m / cell_m)] < params.darkest_shade * _median_seen(light[first:last])
    begins = int(np.argmax(near))
    inside = np.flatnonzero(~near[begins:])
    return float(begins + inside[0]) if near[:3].any() and len(inside) else 0.0


def _plane_from(low: float, high: float, profile: Profile, cell_m: float) -> tuple[int, int] | None:
    """Between which positions depth shows a panel to begin beside a recessed channel; None where there is none.

    A channel is a strip behind the plane, between two on it. What cameras above see in it lies below where they see it on the
    plane: a part of the channel under the front over it has no depth.
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
    """The innermost clear step of colour about where depth shows a panel to begin, or else the clearest one there."""
    params = tuned(Params)
    off = round(params.depth_off_m / cell_m)
    first, last = earliest - off, latest + off + 1
    peaks = _peaks(gradient[first - 1 : last + 1], least)
    return (first - 1 + peaks[-1] if peaks else first + int(np.argmax(gradient[first:last]))) + 0.5


def _rim(surface: Surface, rows: slice, columns: slice) -> float:
    """Mean height over the plane of a panel's outer eighths at both sides, half way up: of the stiles, where it is framed."""
    quarter, eighth = (rows.stop - rows.start) // 4, (columns.stop - columns.start) // 8
    rim = np.r_[columns.start : columns.start + eighth, columns.stop - eighth : columns.stop]
    height, points = (values[rows.start + quarter : rows.stop - quarter, rim] for values in (surface.height_m, surface.points))
    return float((height * points).sum() / points.sum()) if points.any() else float("-inf")


def _under_lip(top: float, bottom: float, profile: Profile, rim_m: float, cell_m: float) -> float:
    """The upper edge, moved down where a lip of the panel's colour, as a worktop's, was taken for its upper part.

    Depth shows a lip before the panel's plane, and before its rim: the upper rail of a frame is as high as its stiles. What
    stands out of a front, as a grip along its edge, has another front or a lip over it.
    """
    params, start, middle = tuned(Params), round(top), round((top + bottom) / 2)
    reach, off = round(params.lip_m / cell_m), round(params.depth_off_m / cell_m)
    height = profile.height - np.fmax(_median_seen(profile.height[start + reach : middle]), rim_m)
    usual = float(np.median(profile.points[start + reach : middle])) if start + reach < middle else 0.0
    over = slice(max(start - reach // 2, 0), max(start - off, 0))
    points = profile.points[over]
    if points.sum() > params.known * usual * len(points) and np.nansum(height[over] * points) > -params.before_m * points.sum():
        return top
    strip = np.nan_to_num(height[start : start + reach])
    peak = int(np.argmax(strip[: reach // 2])) if len(strip) else 0
    below = np.flatnonzero(strip[peak:] < strip[peak : peak + 1] / 2)
    if not len(below) or strip[peak] < params.behind_m:
        return top
    least = max(params.clear * _own(top, bottom, profile), params.least_gradient)
    begins = start + peak + int(below[0])
    return _step_near(begins, begins, profile.gradient, least, cell_m)


def _lip_over(top: float, profile: Profile, cell_m: float) -> bool:
    """Whether something stands out directly over a panel, which may throw a shadow on it."""
    params, start = tuned(Params), round(top)
    over = profile.height[max(start - round(params.shadow_m / cell_m), 0) : start]
    known = over[np.isfinite(over)]
    return not len(known) or bool(np.median(known) > params.before_m)


def _above_shadow(top: float, bottom: float, lab: np.ndarray, cell_m: float) -> float:
    """The upper edge, moved up where what it follows is the end of a shadow that a lip, as a worktop's, throws on the panel.

    The shadow reaches up to where the surface is no longer darker by one factor in all colours, or darkest.
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
        mixed -= 1  # with what is over the panel
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
    """How far before its last, darkest position light is half way to the uneven light beyond; None where that is dark too."""
    usual = float(np.median(shade[:-3])) if len(shade) > 3 else 0.0
    if usual <= shade[-1] / tuned(Params).least_shade:
        return None
    half = (usual + shade[-1]) / 2
    back = int(np.argmax(shade[::-1] >= half))
    lower, upper = float(shade[-back]), float(shade[-back - 1])
    return back - 1 + (half - lower) / (upper - lower)


def shading(lab: np.ndarray, usual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Light of colours (n, 3) relative to a usual one (3,), and its unevenness over red, green and blue.

    In a shadow a surface is darker by one factor in all of them: its unevenness is 0.
    """
    relative = _linear_light(lab) / np.maximum(_linear_light(usual[None]), 1e-3)
    shade = relative.mean(axis=1)
    return shade, np.abs(relative / np.maximum(shade, 1e-3)[:, None] - 1).max(axis=1)


def _linear_light(lab: np.ndarray) -> np.ndarray:
    """Linear light in red, green and blue, 0..1, of rows of colours."""
    rgb = cv2.cvtColor(np.clip(lab, 0, 255).astype(np.uint8)[None], cv2.COLOR_LAB2RGB)[0]
    return np.asarray((rgb / 255.0) ** 2.2)


def _peaks(window: np.ndarray, least: float) -> list[int]:
    """Where the gradient has clear peaks."""
    least = max(least, tuned(Params).strong_share * float(window.max(initial=0.0)))
    return [
        i for i in range(1, len(window) - 1) if window[i] >= least and window[i] >= window[i - 1] and window[i] >= window[i + 1]
    ]


def _gap(slope: np.ndarray, inner: int, low: int) -> tuple[int, int] | None:
    """Outer and inner flank of a dark gap whose inner flank lies at `inner`; None when what is beyond stays dark."""
    if slope[inner] <= 0 or inner <= low:
        return None
    outer = low + int(np.argmin(slope[low:inner]))
    return (outer, inner) if slope[outer] <= -0.4 * slope[inner] else None


def _dark_width(light: np.ndarray, outer: int, inner: int, cell_m: float) -> float:
    """Width in positions of a gap without light that is as dark as what lies between two flanks, however blurred."""
    around = round(tuned(Params).half_gap_m / cell_m) + 2
    low, high = max(outer - around, 0), inner + around + 1
    beside = min(float(np.nanmax(side, initial=1e-3)) for side in (light[low : outer + 1], light[inner:high]))
    return float(np.nansum(np.clip(1 - light[low:high] / beside, 0, None)))


def _below_upper_face(top: float, bottom: float, profile: Profile, lab: np.ndarray, cell_m: float) -> float | None:
    """The upper edge of a panel below the gap to another of its colour that is wide enough to see into; None where none is.

    From above, a camera sees through such a gap (a recessed channel, mostly) the upper face of the front, of its colour in
    another light; the front begins where that light changes. Under another colour the same may be a lip's shadow.
    """
    params, light, gradient = tuned(Params), profile.light, profile.gradient
    start, reach = round(top), round(params.upper_face_m / cell_m)
    low, panel = max(start - 2 * reach, 0), slice(start + reach, max(round((top + bottom) / 2), start + reach + 1))
    darkness = np.nan_to_num(1 - light[low : start + reach] / _median_seen(light[panel])).clip(0)
    half_dark = np.flatnonzero(darkness > darkness.max() / 2)
    if (
        darkness.max() < params.open_dark
        or not params.open_gap_m < darkness[half_dark].sum() * cell_m
        or len(half_dark) * cell_m > params.channel_m
    ):
        return None
    middle = low + int(np.argmax(darkness))
    over = max(middle - reach, 0) + int(np.argmax(gradient[max(middle - reach, 0) : middle + 1]))
    if not _same_colour(lab[max(over - reach // 2, 0) : max(over - 1, 1)], lab[panel]):
        return None
    flank = middle + int(np.argmax(gradient[middle : middle + reach]))
    least = max(params.clear * _own(top, bottom, profile), params.least_gradient)
    window = gradient[flank : flank + reach + 2]
    steps = [
        i for i in range(1, len(window) - 1) if window[i] >= least and window[i] >= window[i - 1] and window[i] > window[i + 1]
    ]
    return flank + steps[-1] + 0.5 if steps else top


def _same_colour(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two patches of CIELAB colours may be of one material in nearly the same light."""
    params = tuned(Params)
    one, other = (np.median(patch.reshape(-1, 3), axis=0) for patch in (first, second))
    (shade,), (unevenness,) = shading(one[None], other)
    return bool(unevenness < params.even_shade and params.least_shade < shade < 1 / params.least_shade)


def _luminance(lightness: np.ndarray) -> np.ndarray:
    """Relative luminance 0..1 of OpenCV's 8-bit CIELAB lightness."""
    return np.asarray(((np.asarray(lightness) * (100 / 255) + 16) / 116) ** 3)


def surface_of(mosaic: np.ndarray, relief: Relief, seams: PanelOdds) -> Surface:
    """Of a mosaic (rows, columns, 3), the relief of the same plane and what the network sees in both."""
    lab, seen = as_lab(mosaic)
    height = relief.raised * relief.lift_m + (1 - relief.raised) * relief.level_m
    height, points = (
        np.repeat(np.repeat(values, STEP, axis=0), STEP, axis=1)[: lab.shape[0], : lab.shape[1]]
        for values in (height, relief.count)
    )
    return Surface(lab, seen, height, points, seams)


def as_lab(mosaic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The mosaic in Lab (float), and where it has colour."""
    seen = (mosaic[..., 0] | mosaic[..., 1] | mosaic[..., 2]) > 0  # numpy is slow along an axis of three
    return cv2.cvtColor(mosaic, cv2.COLOR_RGB2LAB).astype(np.float32), np.asarray(seen)
