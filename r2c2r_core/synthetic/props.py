"""Unprompted objects of a kitchen: sink, hob, kettle, board, jar, plant, shelf, sockets, window frame."""

from collections.abc import Callable

import numpy as np

from r2c2r_core.synthetic.kitchen import Kitchen, Paint, Prop
from r2c2r_core.synthetic.patches import Patch, box, lathe, quad, tube

_SINK_DEPTH_M, _SINK_LENGTH_M = 0.16, 0.38
_STEEL = Paint(kind="steel", colour=(0.55, 0.55, 0.56), gloss=0.7, texel_m=0.002)
_DARK = Paint(kind="plain", colour=(0.03, 0.03, 0.03), texel_m=0.004)


def prop_patches(kitchen: Kitchen, prop: Prop) -> list[Patch]:
    """The surfaces of one prop; all background."""
    return _BUILDERS[prop.kind](prop, kitchen.worktop_top_m + prop.z)


def sink_bounds(sink: Prop) -> tuple[float, float, float, float]:
    """x0, x1, y0, y1 of the hole in the worktop."""
    half = sink.width_m / 2
    return sink.x - half, sink.x + half, sink.y - _SINK_LENGTH_M / 2, sink.y + _SINK_LENGTH_M / 2


def crockery(x0: float, x1: float, y: float, z: float) -> list[Patch]:
    """A row of bowls and mugs on a shelf, 11 cm apart; their choice depends on the position alone."""
    row = []
    for number, x in enumerate(np.arange(x0 + 0.07, x1 - 0.05, 0.11)):
        white = 0.35 + 0.4 * ((7 * number + round(100 * z)) % 5) / 4
        paint = Paint(kind="laminate", colour=(white, 0.95 * white, 0.88 * white), gloss=0.4, texel_m=0.002)
        tall = (number + round(100 * z)) % 3
        profile = [(0.0, 0.03), (0.036, 0.03), (0.04, 0.10), (0.042, 0.10), (0.04, 0.0)]
        bowl = [(0.0, 0.02), (0.046, 0.06), (0.049, 0.06), (0.025, 0.0)]
        row.append(lathe((float(x), y, z), profile if tall else bowl, paint))
    return row


def window_frame(window: Patch) -> list[Patch]:
    """White bars around a window in a side wall and across its middle."""
    white = Paint(kind="laminate", colour=(0.80, 0.80, 0.79), texel_m=0.006)
    low, high = window.grid.reshape(-1, 3).min(axis=0), window.grid.reshape(-1, 3).max(axis=0)
    x0, x1 = low[0] - 0.03, low[0] + 0.035
    middle = (low[1] + high[1]) / 2
    bars = [
        (low[1] - 0.06, low[1], low[2] - 0.06, high[2] + 0.06),
        (high[1], high[1] + 0.06, low[2] - 0.06, high[2] + 0.06),
        (middle - 0.025, middle + 0.025, low[2], high[2]),
        (low[1], high[1], high[2], high[2] + 0.06),
        (low[1], high[1], low[2] - 0.06, low[2]),
    ]
    return [patch for y0, y1, z0, z1 in bars for patch in box((x0, y0, z0), (x1, y1, z1), white)]


def _sink(prop: Prop, top: float) -> list[Patch]:
    x0, x1, y0, y1 = sink_bounds(prop)
    bottom = top - _SINK_DEPTH_M
    dx, dy, dz = np.array([x1 - x0, 0.0, 0.0]), np.array([0.0, y1 - y0, 0.0]), np.array([0.0, 0.0, top - bottom])
    basin = [
        quad(np.array([x0, y1, bottom]), dx, -dy, prop.paint),
        quad(np.array([x0, y1, top]), dx, -dz, prop.paint),
        quad(np.array([x1, y0, top]), -dx, -dz, prop.paint),
        quad(np.array([x0, y0, top]), dy, -dz, prop.paint),
        quad(np.array([x1, y1, top]), -dy, -dz, prop.paint),
    ]
    rim = 0.018
    for low, high in (
        ((x0 - rim, y0 - rim), (x0, y1 + rim)),
        ((x1, y0 - rim), (x1 + rim, y1 + rim)),
        ((x0, y0 - rim), (x1, y0)),
        ((x0, y1), (x1, y1 + rim)),
    ):
        basin += box((*low, top), (*high, top + 0.003), prop.paint, faces="front back left right top")
    foot = np.array([prop.x, y1 + 0.045, top])
    turn = np.linspace(0, np.pi, 11)
    arch = np.column_stack([np.zeros(11), -0.09 * (1 - np.cos(turn)), 0.24 + 0.09 * np.sin(turn)])
    spout = np.vstack([[0.0, 0.0, 0.0], [0.0, 0.0, 0.12], arch, [0.0, -0.18, 0.20]]) + foot
    lever = np.array([[0.02, 0.0, 0.05], [0.075, 0.0, 0.075]]) + foot
    return [
        *basin,
        tube(spout, 0.011, _STEEL),
        tube(lever, 0.006, _STEEL),
        lathe(_triple(foot), [(0.024, 0.05), (0.026, 0.0)], _STEEL),
    ]


def _hob(prop: Prop, top: float) -> list[Patch]:
    half = prop.width_m / 2
    return box(
        (prop.x - half, prop.y - 0.255, top),
        (prop.x + half, prop.y + 0.255, top + 0.006),
        prop.paint,
        faces="front left right top",
    )


def _kettle(prop: Prop, top: float) -> list[Patch]:
    radius = prop.width_m / 2 * 0.85
    profile = [
        (0.0, 0.215),
        (0.012, 0.212),
        (0.014, 0.195),
        (0.7 * radius, 0.185),
        (0.8 * radius, 0.15),
        (radius, 0.03),
        (radius, 0.0),
    ]
    centre = np.array([prop.x, prop.y, top])
    turn = np.linspace(-1.2, 1.2, 11)
    grip = np.column_stack([0.72 * radius + 0.055 * np.cos(turn), np.zeros(11), 0.11 + 0.06 * np.sin(turn)]) + centre
    return [lathe(_triple(centre), profile, prop.paint), tube(grip, 0.009, _DARK)]


def _board(prop: Prop, top: float) -> list[Patch]:
    """A chopping board leaning on the splashback."""
    half, height, lean = prop.width_m / 2, 0.36, 0.06
    right, down = np.array([2 * half, 0.0, 0.0]), np.array([0.0, -lean, -height])
    front_top = np.array([prop.x - half, -0.028, top + height])
    back = np.array([0.0, 0.018, 0.0])
    return [
        quad(front_top, right, down, prop.paint),
        quad(front_top + back, right, -back, prop.paint),
        quad(front_top + back, -back, down, prop.paint),
        quad(front_top + right, back, down, prop.paint),
    ]


def _jar(prop: Prop, top: float) -> list[Patch]:
    """A jar with wooden spoons."""
    radius, centre = prop.width_m / 2 * 0.9, np.array([prop.x, prop.y, top])
    wood = Paint(kind="wood", colour=(0.45, 0.30, 0.16), accent=(0.3, 0.18, 0.08), texel_m=0.002)
    spoons = []
    for angle, length in ((0.4, 0.30), (2.1, 0.27), (4.0, 0.32)):
        tip = np.array([0.5 * radius * np.cos(angle), 0.5 * radius * np.sin(angle), 0.05])
        end = np.array([1.3 * radius * np.cos(angle), 1.3 * radius * np.sin(angle), length])
        spoons.append(tube(np.linspace(tip, end, 3) + centre, 0.006, wood))
    return [
        lathe(_triple(centre), [(radius * 0.9, 0.02), (radius * 0.9, 0.15), (radius, 0.15), (radius, 0.0)], prop.paint),
        *spoons,
    ]


def _plant(prop: Prop, top: float) -> list[Patch]:
    """A pot with a crown of leaves."""
    radius, centre = prop.width_m / 2 * 0.8, np.array([prop.x, prop.y, top])
    green = Paint(kind="laminate", colour=(0.06, 0.17, 0.05), texel_m=0.003)
    leaves = []
    for step in range(14):
        angle, rise = 2.4 * step, 0.10 + 0.012 * step
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        side = np.array([-out[1], out[0], 0.0]) * 0.022
        base = centre + np.array([0.0, 0.0, 0.10])
        tip = base + out * (0.085 - 0.003 * step) + np.array([0.0, 0.0, rise - 0.02])
        for turned in (side, -side):  # both faces of the leaf
            leaves.append(quad(tip - turned, 2 * turned, base - tip, green))
    return [lathe(_triple(centre), [(0.0, 0.10), (radius, 0.11), (0.75 * radius, 0.0)], prop.paint), *leaves]


def _shelf(prop: Prop, z: float) -> list[Patch]:
    half = prop.width_m / 2
    board = box((prop.x - half, -0.2, z), (prop.x + half, 0.0, z + 0.022), prop.paint)
    books = Paint(kind="spines", colour=(0.3, 0.3, 0.3), texel_m=0.0012, seed=prop.paint.seed)
    paper = Paint(kind="laminate", colour=(0.6, 0.57, 0.5), texel_m=0.003)
    row = box((prop.x - half + 0.02, -0.17, z + 0.022), (prop.x + 0.3 * half, -0.02, z + 0.24), {"front": books, "": paper})
    pot = Paint(kind="laminate", colour=(0.55, 0.5, 0.45), gloss=0.3, texel_m=0.002)
    jar = lathe((prop.x + 0.65 * half, -0.09, z + 0.022), [(0.0, 0.15), (0.04, 0.15), (0.05, 0.12), (0.05, 0.0)], pot)
    return [*board, *row, jar]


def _socket(prop: Prop, z: float) -> list[Patch]:
    half = prop.width_m / 2
    plate = box(
        (prop.x - half, -0.018, z - half), (prop.x + half, -0.009, z + half), prop.paint, faces="front left right top bottom"
    )
    hole = box(
        (prop.x - 0.02, -0.019, z - 0.02),
        (prop.x + 0.02, -0.018, z + 0.02),
        Paint(kind="plain", colour=(0.5, 0.5, 0.49)),
        faces="front",
    )
    return [*plate, *hole]


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    return (float(values[0]), float(values[1]), float(values[2]))


_BUILDERS: dict[str, Callable[[Prop, float], list[Patch]]] = {
    "sink": _sink,
    "hob": _hob,
    "kettle": _kettle,
    "board": _board,
    "jar": _jar,
    "plant": _plant,
    "shelf": _shelf,
    "socket": _socket,
}
