"""Colour palettes of the fronts and their surroundings."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from r2c2r_core.synthetic.kitchen import Paint, Style
from r2c2r_core.synthetic.style import rgb

_HUES = (
    (0.28, 0.36, 0.27),
    (0.06, 0.10, 0.20),
    (0.30, 0.38, 0.44),
    (0.70, 0.64, 0.50),
    (0.36, 0.10, 0.07),
    (0.12, 0.22, 0.20),
    (0.42, 0.42, 0.40),
)
_WOODS = (
    ((0.62, 0.48, 0.32), (0.48, 0.34, 0.20)),
    ((0.52, 0.33, 0.17), (0.36, 0.20, 0.09)),
    ((0.24, 0.12, 0.06), (0.14, 0.06, 0.03)),
    ((0.60, 0.55, 0.47), (0.46, 0.41, 0.34)),
)


def repaint(style: Style, palette: str | None, seed: int) -> Style:
    """The style in the colours of a palette of choices.py; None keeps its own."""
    return style if palette is None else _PAINTERS[palette](style, np.random.default_rng([seed, 13]))


def _painted(style: Style, rng: np.random.Generator) -> Style:
    return _in(style, _hue(rng))


def _wood(style: Style, rng: np.random.Generator) -> Style:
    return _in(style, _veneer(rng))


def _dark(style: Style, rng: np.random.Generator) -> Style:
    tone = rng.uniform(0.010, 0.035) * rng.uniform(0.8, 1.2, 3)
    return _in(style, Paint(kind="laminate", colour=rgb(tone), gloss=float(rng.uniform(0.75, 0.95))))


def _white(style: Style, rng: np.random.Generator) -> Style:
    white = Paint(kind="laminate", colour=rgb(rng.uniform(0.78, 0.84, 3)), gloss=float(rng.uniform(0.15, 0.6)))
    plain = replace(white, gloss=0.2, texel_m=0.003)
    handle = replace(plain, texel_m=0.002) if rng.random() < 0.4 else style.handle
    wall = Paint(kind="plaster", colour=(0.80, 0.80, 0.78), texel_m=0.005)
    worktop = replace(plain, colour=rgb(rng.uniform(0.72, 0.82, 3)), texel_m=0.002)
    return replace(_in(style, white), carcass=plain, plinth=plain, worktop=worktop, splash=wall, wall=wall, handle=handle)


def _two_tone(style: Style, rng: np.random.Generator) -> Style:
    light = Paint(kind="laminate", colour=rgb(rng.uniform(0.70, 0.82, 3)), gloss=0.2)
    below, above = (_hue(rng), light if rng.random() < 0.6 else _veneer(rng))
    return replace(_in(style, below), wall_front=above)


def _in(style: Style, front: Paint) -> Style:
    """The style with every front in one paint, and a darker plinth."""
    plinth = replace(style.plinth, colour=rgb(np.array(front.colour) * 0.6))
    return replace(style, base_front=front, wall_front=front, plinth=plinth)


def _hue(rng: np.random.Generator) -> Paint:
    colour = np.array(_HUES[int(rng.integers(len(_HUES)))]) * rng.uniform(0.85, 1.15)
    return Paint(kind="laminate", colour=rgb(colour), gloss=float(rng.uniform(0.1, 0.3)))


def _veneer(rng: np.random.Generator) -> Paint:
    colour, accent = _WOODS[int(rng.integers(len(_WOODS)))]
    return Paint(kind="wood", colour=colour, accent=accent, gloss=float(rng.uniform(0.1, 0.3)))


_PAINTERS: dict[str, Callable[[Style, np.random.Generator], Style]] = {
    "painted": _painted,
    "wood": _wood,
    "dark": _dark,
    "white": _white,
    "two-tone": _two_tone,
}
