"""Fronts with what they carry, and what stands among them: appliances, niches, end panels."""

import cv2
import numpy as np

from training.canvas import CELL_M, Area, Elevation, any_paint, clip, fill, noise
from training.styles import Style, any_style, board, grained


def front(e: Elevation, style: Style, area: Area, *, door: bool, side: str, wall: bool) -> None:
    """A front with its gap around it, its profile and its handle; its edges are told."""
    rng = e.rng
    left, top, right, bottom = area
    gap = max(style.gap_m / CELL_M, 0.4) * (2 if style.frame else 1)  # a neighbour has the other half
    channel = e.cells(rng.uniform(0.008, 0.035)) if style.handle == "channel" and not wall else 0
    if right - left < e.cells(0.05) or bottom - top - channel < e.cells(0.05):
        return
    fill(e, (left, top, right, bottom), style.paint * style.gap_light * rng.uniform(0.85, 1.1))
    if style.gap_shown < 1:
        _dashed(e, (left, top, right, bottom), style)
    if channel:
        if rng.random() < 0.7:  # the upper face of the front, which a camera above it sees behind its edge
            band = e.cells(rng.uniform(0.002, 0.8 * channel * CELL_M))
            fill(e, (left, top - band, right, top), style.paint * rng.uniform(0.55, 1.3), lift=-rng.uniform(0.0, 0.02))
        fill(e, (left, top, right, top + channel), style.paint * rng.uniform(0.03, 0.6), lift=-rng.uniform(0.01, 0.04))
        top += channel
    light = style.paint * (1 + rng.uniform(-style.uneven, style.uneven))
    inner = (left + gap / 2, top + gap / 2, right - gap / 2, bottom - gap / 2)
    board(e, inner, light, style)
    box = tuple(round(v) for v in inner)
    _profile(e, style, box, light, door=door)
    _tell(e, (left, top, right, bottom))
    _handle(e, style, box, door=door, side=side, wall=wall)
    if rng.random() < 0.03:
        _cloth(e, box)


def _dashed(e: Elevation, area: Area, style: Style) -> None:
    """Where a gap does not show, it is as light as the front."""
    at = clip(e, area)
    shape = e.front[at].shape
    if all(shape):
        hidden = noise(e.rng, shape, e.rng.uniform(2, 12)) > np.clip(style.gap_shown, 0, 1)
        e.colour[at] = np.where(hidden[..., None], style.paint, e.colour[at])


def plain(e: Elevation, area: Area, style: Style, paint: np.ndarray) -> None:
    fill(e, area, style.paint * style.gap_light)
    left, top, right, bottom = area
    half = max(style.gap_m / CELL_M, 0.4) / 2
    board(e, (left + half, top + half, right - half, bottom - half), paint, style)
    _tell(e, area)


def _tell(e: Elevation, area: Area) -> None:
    left, top, right, bottom = area
    height, width = e.front.shape
    x0, x1, y0, y1 = max(left, 0), min(right, width), max(top, 0), min(bottom, height)
    if x1 - x0 < 4 or y1 - y0 < 4:
        return
    e.front[y0:y1, x0:x1] = 1
    for x in (left, right):
        if 0 < x < width:
            e.upright[y0:y1, max(x - 1, 0) : x + 1] = 1
    for y in (top, bottom):
        if 0 < y < height:
            e.level[max(y - 1, 0) : y + 1, x0:x1] = 1


def _profile(e: Elevation, style: Style, box: Area, paint: np.ndarray, *, door: bool) -> None:
    """What a front carries that is no edge of it: rails and stiles, beads, slats, glass."""
    rng = e.rng
    left, top, right, bottom = box
    stile = e.cells(style.stile_m if door else min(style.stile_m, (bottom - top) * CELL_M * 0.3))
    if style.kind == "slab" or min(right - left, bottom - top) < 2 * stile + e.cells(0.04):
        if rng.random() < 0.04:  # a groove across a slab
            y = int(rng.integers(top, bottom)) if bottom > top else top
            e.colour[clip(e, (left, y, right, y + 1))] *= rng.uniform(0.4, 0.9)
        return
    if style.kind == "bead":
        for x in range(left + stile, right - stile, e.cells(rng.uniform(0.025, 0.12))):
            e.colour[clip(e, (x, top + stile, x + rng.integers(1, 3), bottom - stile))] *= style.line_light
        return
    if style.kind == "louver":
        pitch = e.cells(rng.uniform(0.02, 0.06))
        for y in range(top + stile, bottom - stile, pitch):
            at = clip(e, (left + stile, y, right - stile, y + pitch))
            e.colour[at] *= np.linspace(1.05, style.line_light, e.front[at].shape[0])[:, None, None]
        return
    inner = (left + stile, top + stile, right - stile, bottom - stile)
    parts = [inner]
    if rng.random() < 0.5:
        _joints(e, style, box, stile, paint)
    if door and rng.random() < 0.15:  # a middle rail
        y = (inner[1] + inner[3]) // 2
        parts = [(inner[0], inner[1], inner[2], y - stile // 2), (inner[0], y + stile // 2, inner[2], inner[3])]
    for part in parts:
        at = clip(e, part)
        if not all(e.front[at].shape):
            continue
        if style.kind == "glass" and door:
            e.colour[at] = any_paint(rng) * (0.3 + noise(rng, e.front[at].shape, rng.uniform(20, 120)))[..., None]
            for _ in range(rng.integers(0, 4)):
                y = int(rng.integers(part[1], part[3]))
                e.colour[clip(e, (part[0], y, part[2], y + rng.integers(2, 9)))] = any_paint(rng)
            e.lift[at] = np.nan if rng.random() < 0.6 else -0.02
        else:
            e.colour[at] *= style.recess_light
            e.lift[at] = -rng.uniform(0.003, 0.012)
        _rim(e, part, style, rng)
        if style.kind == "raised":
            pad = e.cells(rng.uniform(0.012, 0.04))
            inner_box = (part[0] + pad, part[1] + pad, part[2] - pad, part[3] - pad)
            if min(inner_box[2] - inner_box[0], inner_box[3] - inner_box[1]) > 4:
                _rim(e, inner_box, style, rng)


def _joints(e: Elevation, style: Style, box: Area, stile: int, paint: np.ndarray) -> None:
    """Rails between stiles: their grain runs across, and the joints may show."""
    rng = e.rng
    left, top, right, bottom = box
    light = paint * rng.uniform(0.94, 1.04)
    for rail in ((left + stile, top, right - stile, top + stile), (left + stile, bottom - stile, right - stile, bottom)):
        at = clip(e, rail)
        if not all(e.front[at].shape):
            continue
        if style.grain:
            e.colour[at] = light
            grained(e, at, style, turned=True)
        if rng.random() < 0.4:
            for x in (rail[0], rail[2]):
                e.colour[clip(e, (x, rail[1], x + 1, rail[3]))] *= rng.uniform(0.6, 0.98)


def _rim(e: Elevation, part: Area, style: Style, rng: np.random.Generator) -> None:
    """Light and shade along the border of a recess."""
    left, top, right, bottom = part
    width = int(rng.integers(1, 5))
    shade, shine = style.line_light, 1 + (1 - style.line_light) * rng.uniform(0, 0.6)
    e.colour[clip(e, (left, top, right, top + width))] *= shade
    e.colour[clip(e, (left, top, left + width, bottom))] *= 0.5 * (shade + rng.choice([shade, shine]))
    e.colour[clip(e, (right - width, top, right, bottom))] *= 0.5 * (shine + rng.choice([shade, shine]))
    e.colour[clip(e, (left, bottom - width, right, bottom))] *= shine if rng.random() < 0.7 else shade


def _handle(e: Elevation, style: Style, box: Area, *, door: bool, side: str, wall: bool) -> None:
    rng = e.rng
    left, top, right, bottom = box
    wide, high = right - left, bottom - top
    if style.handle in ("none", "channel") or rng.random() < 0.02:
        return
    thick, off = e.cells(style.handle_thick_m), e.cells(style.handle_off_m)
    if style.handle == "edge":  # a profile along the upper edge
        tall = e.cells(rng.uniform(0.008, 0.03))
        y = bottom - tall if wall else top
        if door and rng.random() < 0.3:
            x = right - tall if side == "right" else left
            area = (x, top, x + tall, bottom)
        else:
            area = (left, y, right, y + tall)
    elif style.handle == "knob":
        size = e.cells(rng.uniform(0.018, 0.04))
        x = ((right - off - size) if side == "right" else left + off) if door else (left + right - size) // 2
        y = (bottom - off - size if wall else top + off) if door else (top + bottom - size) // 2
        area = (x, y, x + size, y + size)
    elif style.handle == "cup":
        size = (e.cells(rng.uniform(0.07, 0.12)), e.cells(rng.uniform(0.025, 0.045)))
        y = (bottom - off - size[1] if wall else top + off) if door else top + max((high - size[1]) // 3, 2)
        x = ((right - off - size[0]) if side == "right" else left + off) if door else (left + right - size[0]) // 2
        area = (x, y, x + size[0], y + size[1])
    else:
        upright = door and rng.random() < 0.85
        span = high if upright else wide
        long = e.cells(style.handle_m) if not style.handle_share else round(style.handle_share * span)
        long = min(long, span - 2 * e.cells(0.015))
        if long < thick * 2:
            return
        if upright:
            x = right - off - thick if side == "right" else left + off
            start = rng.choice([0, 1, 2], p=[0.25, 0.5, 0.25])
            y = [top + (high - long) // 2, bottom - off - long if wall else top + off, bottom - off - long][start]
            y = min(max(y, top + 3), bottom - long - 3)
            area = (x, y, x + thick, y + long)
        else:
            place = rng.random()
            y = top + off if place < 0.5 else (top + high // 2 if place < 0.85 else bottom - off - thick)
            y = bottom - off - thick if wall and place < 0.6 else y
            y = min(max(y, top + 2), bottom - thick - 2)
            area = (left + (wide - long) // 2, y, left + (wide - long) // 2 + long, y + thick)
    _raised(e, style, area)


def _raised(e: Elevation, style: Style, area: Area) -> None:
    rng = e.rng
    at = clip(e, area)
    if not all(e.front[at].shape):
        return
    mask = np.zeros(e.front.shape, np.float32)
    if style.handle == "knob":
        centre = ((area[0] + area[2]) // 2, (area[1] + area[3]) // 2)
        cv2.circle(mask, centre, max((area[2] - area[0]) // 2, 2), 1.0, -1)
    else:
        mask[at] = 1
    if rng.random() < 0.7:  # its shadow, where lamps throw it
        shift = rng.integers(-14, 15), rng.integers(1, 20)
        move = np.array([[1, 0, shift[0]], [0, 1, shift[1]]], np.float32)
        pad = 40
        window = clip(e, (area[0] - pad, area[1] - pad, area[2] + pad, area[3] + pad))
        shadow = cv2.warpAffine(np.ascontiguousarray(mask[window]), move, mask[window].shape[::-1])
        shadow = cv2.GaussianBlur(shadow, (0, 0), rng.uniform(0.8, 6))
        e.colour[window] *= (1 - rng.uniform(0.1, 0.6) * shadow)[..., None]
    shine = 1 + rng.uniform(0, 0.5) * (2 * noise(rng, e.front[at].shape, rng.uniform(2, 20)) - 1)
    e.colour[at] += mask[at][..., None] * (style.handle_colour * shine[..., None] - e.colour[at])
    e.handle[at] = np.maximum(e.handle[at], mask[at] > 0.5)
    e.lift[at] = np.where(mask[at] > 0.5, rng.uniform(0.018, 0.045), e.lift[at])


def appliance(e: Elevation, area: Area) -> None:
    """One front, whatever lines it carries: a control panel, a window, a bar."""
    rng = e.rng
    left, top, right, bottom = area
    paint = np.full(3, rng.choice([rng.uniform(0.01, 0.08), rng.uniform(0.3, 0.8)]))
    fill(e, area, paint * rng.uniform(0.05, 0.5))
    style = any_style(rng)
    board(e, (left + 1, top + 1, right - 1, bottom - 1), paint, style)
    high = bottom - top
    panel = top + round(high * rng.uniform(0.1, 0.25))
    if rng.random() < 0.8:
        e.colour[clip(e, (left, panel, right, panel + rng.integers(1, 4)))] *= rng.uniform(0.1, 0.8)
        e.colour[clip(e, (left + 2, top + 2, right - 2, panel))] *= rng.uniform(0.4, 1.4)
    if rng.random() < 0.6:
        pad = round(high * rng.uniform(0.08, 0.2))
        window = (left + pad, panel + pad, right - pad, bottom - pad)
        if window[2] - window[0] > 8 and window[3] - window[1] > 8:
            e.colour[clip(e, window)] = paint * rng.uniform(0.05, 0.6)
    for _ in range(rng.integers(0, 6)):
        x, y = int(rng.integers(left, right)), int(rng.integers(top, max(panel, top + 1)))
        _raised(e, style, (x, y, x + e.cells(0.025), y + e.cells(0.025)))
    if rng.random() < 0.8:
        pad = round((right - left) * rng.uniform(0.05, 0.2))
        y = panel + e.cells(rng.uniform(0.02, 0.06))
        _raised(e, style, (left + pad, y, right - pad, y + e.cells(rng.uniform(0.01, 0.025))))
    _tell(e, area)


def niche(e: Elevation, area: Area, style: Style) -> None:
    """An open shelf: what stands in it, and boards."""
    at = clip(e, area)
    if not all(e.front[at].shape):
        return
    fill(e, area, style.paint * e.rng.uniform(0.1, 0.7), texture=0.5)
    e.lift[at], e.known[at] = np.nan, e.rng.random() < 0.3
    for _ in range(e.rng.integers(1, 8)):
        x, y = e.rng.integers((area[0], area[1]), (area[2], area[3])).tolist()
        wide, high = e.rng.integers(10, 90, 2).tolist()
        e.colour[clip(e, (x, y, min(x + wide, area[2]), min(y + high, area[3])))] = any_paint(e.rng)
    for y in np.linspace(area[1], area[3], e.rng.integers(2, 5)).astype(int):
        e.colour[clip(e, (area[0], y, area[2], y + e.rng.integers(5, 9)))] = style.paint


def _cloth(e: Elevation, box: Area) -> None:
    """A towel, a paper, a magnet: on a front, and no edge of it."""
    rng = e.rng
    wide, high = e.cells(rng.uniform(0.05, 0.35)), e.cells(rng.uniform(0.05, 0.5))
    x = int(rng.integers(box[0], max(box[2] - wide, box[0] + 1)))
    y = int(rng.integers(box[1], max(box[3] - high, box[1] + 1)))
    at = clip(e, (x, y, min(x + wide, box[2]), min(y + high, box[3])))
    if all(e.front[at].shape):
        e.colour[at] = any_paint(rng) * (0.5 + noise(rng, e.front[at].shape, rng.uniform(3, 30)))[..., None]
        e.lift[at] = rng.uniform(0.0, 0.03)
