"""Elevations of furniture drawn at random, with the edges of their fronts: what the seam network is trained on.

Everything is drawn straight onto the orthomosaic's grid: no camera, no kitchen generator of the project or of its benchmarks
has a part in it, so both of those stay worlds the network has not seen. Sizes, styles, colours, light, blur and holes are drawn
far more widely than kitchens are built.
"""

import cv2
import numpy as np

from training.canvas import CELL_M, Area, Elevation, any_paint, clip, fill, noise
from training.fronts import appliance, front, niche, plain
from training.styles import FaceFrame, Style, any_style, grained


def draw(seed: int) -> Elevation:
    """One elevation with everything on it, before it is looked at."""
    rng = np.random.default_rng(seed)
    height, width = round(rng.uniform(1.3, 2.6) / CELL_M), round(rng.uniform(1.6, 3.4) / CELL_M)
    shape = (height, width)
    e = Elevation(
        rng,
        _backdrop(rng, shape),
        np.full(shape, np.nan, np.float32),
        np.zeros(shape, bool),
        np.zeros(shape, np.uint8),
        np.zeros(shape, np.uint8),
        np.zeros(shape, np.uint8),
        np.zeros(shape, np.uint8),
    )
    first = any_style(rng)
    if rng.random() < 0.12:  # furniture painted as the wall
        e.colour *= first.paint / np.maximum(e.colour.mean(axis=(0, 1)), 1e-3) * rng.uniform(0.85, 1.15)
    second = first if rng.random() < 0.7 else any_style(rng)
    what = rng.choice(["base", "both", "tall", "wall", "mixed", "closet"], p=[0.3, 0.2, 0.12, 0.13, 0.15, 0.1])
    if what in ("base", "both", "mixed"):
        _base_row(e, first, tall_share=0.3 if what == "mixed" else 0.05)
    if what in ("wall", "both"):
        top = 0 if what == "wall" and rng.random() < 0.5 else e.cells(rng.uniform(0.02, 0.2))
        tall = e.cells(rng.uniform(0.3, 0.95))
        _row(e, second, (0, top, width, min(top + tall, height - 1)), rng.uniform(0.25, 0.7), wall=True)
    if what in ("tall", "closet"):
        plinth = e.cells(rng.uniform(0.0, 0.16))
        top = e.cells(rng.uniform(0.0, 0.25))
        _row(e, first, (0, top, width, height - plinth), rng.uniform(0.35, 1.0 if what == "closet" else 0.65), tall=True)
        fill(e, (0, height - plinth, width, height), first.paint * rng.uniform(0.1, 1.0), lift=-rng.uniform(0, 0.05))
    return e


def _backdrop(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """A wall, tiled or not, or a smear of what is behind."""
    canvas = np.ones((*shape, 3), np.float32) * any_paint(rng).astype(np.float32)
    kind = rng.random()
    if kind < 0.3:
        size = rng.integers(20, 120)
        canvas[(np.arange(shape[0]) % size) < rng.integers(1, 3)] *= rng.uniform(0.5, 1.2)
        canvas[:, (np.arange(shape[1]) % (size * rng.integers(1, 3))) < 2] *= rng.uniform(0.5, 1.2)
    elif kind < 0.6:
        canvas *= 0.4 + 1.2 * noise(rng, shape, rng.uniform(4, 60))[..., None]
        for _ in range(rng.integers(2, 14)):
            corner = rng.integers(0, (shape[1], shape[0]))
            size = rng.integers(10, 250, 2)
            cv2.rectangle(canvas, corner.tolist(), (corner + size).tolist(), any_paint(rng).tolist(), -1)
        canvas = cv2.GaussianBlur(canvas, (0, 0), rng.uniform(0.5, 8))
    return canvas


def _base_row(e: Elevation, style: Style, tall_share: float) -> None:
    rng = e.rng
    height, width = e.lift.shape
    floor = height - e.cells(rng.choice([0.0, rng.uniform(0, 0.15)]))
    plinth, front = e.cells(rng.uniform(0.0, 0.2)), e.cells(rng.uniform(0.55, 0.9))
    fill(e, (0, floor, width, height), any_paint(rng), texture=rng.uniform(0, 0.4))
    fill(e, (0, floor - plinth, width, floor), any_paint(rng) if rng.random() < 0.5 else style.paint * rng.uniform(0.05, 0.9))
    bottom = floor - plinth
    top = max(bottom - front, 2)
    left, right = (0, width) if rng.random() < 0.35 else sorted(rng.integers(0, width, 2).tolist())
    if right - left < e.cells(0.5):
        left, right = 0, width
    _row(e, style, (left, top, right, bottom), rng.uniform(0.3, 0.75), tall_share=tall_share)
    _neighbours(e, left, right, bottom)
    if rng.random() < 0.85:
        _worktop(e, left, right, top)


def _worktop(e: Elevation, left: int, right: int, top: int) -> None:
    """Over the low units of a row, between its tall ones; it may hide the upper edges of fronts."""
    rng = e.rng
    thick, lip = e.cells(rng.uniform(0.01, 0.06)), rng.uniform(0.005, 0.04)
    overlap = e.cells(rng.uniform(0, 0.008)) if rng.random() < 0.3 else 0
    paint, texture = any_paint(rng), rng.uniform(0, 0.5)
    shade = e.cells(rng.uniform(0.004, 0.07)) if rng.random() < 0.6 else 0
    ramp = np.linspace(rng.uniform(0.3, 0.95), 1, shade) if rng.random() < 0.6 else np.full(shade, rng.uniform(0.4, 0.95))
    above = e.front[clip(e, (0, max(top - thick - e.cells(0.1), 0), e.front.shape[1], max(top - thick, 1)))]
    low = ~above.any(axis=0)
    low[:left], low[right:] = False, False
    for first, last in _stretches(low):
        covered = e.front[clip(e, (first, top, last, top + 1))].any(axis=0)
        fill(e, (first, max(top - thick + overlap, 0), last, top + overlap), paint, texture=texture, lift=lip)
        edge = slice(max(top + overlap - 1, 0), top + overlap + 1)  # fronts end where the worktop hides them
        e.level[edge, first:last] = np.maximum(e.level[edge, first:last], covered)
        rows = slice(top + overlap, min(top + overlap + shade, len(e.front)))
        e.colour[rows, first:last] *= ramp[: rows.stop - rows.start, None, None].astype(np.float32)


def _stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    steps = np.flatnonzero(np.diff(np.pad(flags.astype(np.int8), 1)))
    return list(zip(steps[::2].tolist(), steps[1::2].tolist(), strict=True))


def _neighbours(e: Elevation, left: int, right: int, bottom: int) -> None:
    """What stands at the ends of a row: a wall, the side of a machine, a gap before it; none of it is a front."""
    rng = e.rng
    height, width = e.front.shape
    for k in range(2):
        if rng.random() < 0.35:
            continue
        gap, wide = e.cells(rng.uniform(0.0, 0.06)), e.cells(rng.uniform(0.03, 0.8))
        top = max(bottom - e.cells(rng.uniform(0.3, 2.2)), 0)
        start, stop = (left - gap - wide, left) if k else (right, right + gap + wide)
        if stop <= 0 or start >= width:
            continue
        low = height if rng.random() < 0.5 else bottom
        fill(e, (start, top, stop, low), any_paint(rng) * rng.uniform(0.05, 0.5))
        block = (start, top, stop - gap, low) if k else (start + gap, top, stop, low)
        fill(e, block, any_paint(rng), texture=rng.uniform(0, 0.15), lift=rng.uniform(-0.05, 0.12))
        e.known[clip(e, (start, top, stop, low))] = rng.random() < 0.4
        edge = left if k else right
        if 0 < edge < width:  # filling took away half of the row's own edge
            rows = slice(top, bottom)
            beside = e.front[rows, edge if k else edge - 1] > 0
            e.upright[rows, edge - 1 : edge + 1] = np.maximum(e.upright[rows, edge - 1 : edge + 1], beside[:, None])


def _row(
    e: Elevation,
    style: Style,
    area: Area,
    usual_m: float,
    *,
    tall: bool = False,
    wall: bool = False,
    tall_share: float = 0.0,
) -> None:
    """Units side by side, with what is seen of the carcass past them."""
    rng = e.rng
    left, top, right, bottom = area
    _sides(e, style, area)
    x = left - (e.cells(rng.uniform(0, 0.5)) if rng.random() < 0.5 else 0)
    fixed = rng.random() < 0.5
    while x < right:
        wide = e.cells(usual_m if fixed and rng.random() < 0.8 else rng.uniform(0.14, 1.0))
        end = x + wide
        kind = rng.random()
        if kind < 0.05:  # a niche, or nothing
            if rng.random() < 0.5:
                niche(e, (x, top, end, bottom), style)
        elif kind < 0.10:
            appliance(e, (x, top, end, bottom))
        elif kind < 0.13:
            thin = e.cells(rng.uniform(0.012, 0.08))  # an end panel or a filler
            end = x + thin
            plain(e, (x, top, end, bottom), style, style.paint * rng.uniform(0.9, 1.05))
        else:
            reach = top - e.cells(rng.uniform(0.3, 1.4)) if rng.random() < tall_share else top
            _unit(e, style, (x, max(reach, 0), end, bottom), tall=tall or reach < top, wall=wall)
        x = end


def _sides(e: Elevation, style: Style, area: Area) -> None:
    """Sides of the carcass, and shadows on the wall, that slanting views leave around a row; they lie behind the plane."""
    rng = e.rng
    left, top, right, bottom = area
    for k in range(4):
        if rng.random() < 0.5:
            continue
        wide = e.cells(rng.uniform(0.01, 0.4))
        strip = [(left - wide, top, left, bottom), (right, top, right + wide, bottom), (left, top - wide, right, top)][k % 3]
        strip = (left, bottom, right, bottom + wide) if k == 3 else strip
        slide = e.cells(rng.uniform(0, 0.2)) if rng.random() < 0.5 else 0
        strip = (strip[0], strip[1] + slide, strip[2], strip[3] + slide)
        at = clip(e, strip)
        if not all(e.front[at].shape):
            continue
        if rng.random() < 0.6:
            e.colour[at] = style.paint * rng.uniform(0.3, 1.05)
            grained(e, at, style)
        else:
            e.colour[at] *= rng.uniform(0.3, 0.8)


def _unit(e: Elevation, style: Style, area: Area, *, tall: bool, wall: bool) -> None:
    """A cabinet parted into its fronts."""
    rng = e.rng
    left, top, right, bottom = area
    if min(right - left, bottom - top) < e.cells(0.08):
        return
    if style.frame:
        left, top, right, bottom = _framed(e, style, style.frame, area)
        if min(right - left, bottom - top) < e.cells(0.08):
            return
    rail = e.cells(style.frame.between_m) if style.frame else 0
    mullion = e.cells(style.frame.mullion_m) if style.frame and style.frame.mullion_m else 0
    cuts = [bottom - top]
    kind = rng.random()
    wide_m, high_m = (right - left) * CELL_M, (bottom - top) * CELL_M
    if tall and high_m > 1.0:
        count = int(rng.integers(1, 5))
        cuts = _parts(rng, bottom - top, count, even=rng.random() < 0.3)
    elif not wall and kind < 0.42:
        count = int(rng.integers(2, 7 if high_m > 0.6 else 4))
        cuts = _parts(rng, bottom - top, count, even=rng.random() < 0.5)
    elif not wall and kind < 0.55:
        upper = e.cells(rng.uniform(0.1, 0.25))
        cuts = [upper, bottom - top - upper] if bottom - top > 2 * upper else cuts
    elif wall and kind < 0.2:
        cuts = _parts(rng, bottom - top, 2, even=rng.random() < 0.6)
    y = top
    for high in cuts:
        door = high * CELL_M > 0.38
        leaves = 2 if door and wide_m > 0.55 and rng.random() < (0.85 if wide_m > 0.75 else 0.3) else 1
        leaves = 2 if not door and wide_m > 0.7 and rng.random() < 0.12 else leaves
        ends = np.linspace(left, right + mullion, leaves + 1).astype(int)
        for k in range(leaves):
            part = (int(ends[k]), y, int(ends[k + 1]) - mullion, y + high - (rail if y + high < bottom else 0))
            side = ("right", "left")[k] if leaves == 2 else str(rng.choice(["left", "right"]))
            front(e, style, part, door=door, side=side, wall=wall)
        y += high


def _framed(e: Elevation, style: Style, frame: FaceFrame, area: Area) -> Area:
    """A unit's face frame; where its fronts are."""
    left, top, right, bottom = area
    fill(e, area, style.paint * frame.light, lift=-frame.behind_m)
    grained(e, clip(e, area), style)
    e.colour[clip(e, (left, top, left + 1, bottom))] *= frame.joint_light
    stile = e.cells(frame.stile_m)
    over, under = (round(rail / CELL_M) for rail in (frame.top_m, frame.bottom_m))
    return left + stile, top + over, right - stile, bottom - under


def _parts(rng: np.random.Generator, total: int, count: int, *, even: bool) -> list[int]:
    shares = np.ones(count) if even else rng.uniform(0.4, 1.6, count)
    if not even and count > 2 and rng.random() < 0.5:
        shares[1:] = shares[1]
    edges = np.round(np.cumsum(shares / shares.sum()) * total).astype(int)
    return np.diff(edges, prepend=0).tolist()
