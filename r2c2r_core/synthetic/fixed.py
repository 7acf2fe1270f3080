"""Prompted objects without joints: open shelves and hoods."""

import numpy as np

from r2c2r_core.synthetic.kitchen import Fixed, Paint, Style
from r2c2r_core.synthetic.patches import Patch, Vector, box
from r2c2r_core.synthetic.props import crockery

_BOARD_M, _SPACING_M = 0.018, 0.30
_CANOPY_M, _CHIMNEY_M = 0.07, 0.26
_STEEL = Paint(kind="steel", colour=(0.50, 0.51, 0.52), gloss=0.6, texel_m=0.002)


def fixed_patches(thing: Fixed, style: Style, object_id: int) -> list[Patch]:
    """Surfaces of a fixed object, in the frame of its run."""
    if thing.category == "hood":
        return _hood(thing, object_id)
    return _open_shelf(thing, style, object_id)


def _open_shelf(thing: Fixed, style: Style, object_id: int) -> list[Patch]:
    """Two sides, a back and shelves, with cups and bowls on them as background."""
    (x0, y0, z0), (x1, y1, z1) = thing.low, thing.high
    paint = style.wall_front
    patches = box((x0, y0, z0), (x0 + _BOARD_M, y1, z1), paint, object_id=object_id)
    patches += box((x1 - _BOARD_M, y0, z0), (x1, y1, z1), paint, object_id=object_id)
    inner = x0 + _BOARD_M, x1 - _BOARD_M
    patches += box((inner[0], y1 - 0.006, z0), (inner[1], y1, z1), paint, faces="front", object_id=object_id)
    count = max(round((z1 - z0) / _SPACING_M), 1)
    levels = np.linspace(z0, z1 - _BOARD_M, count + 1)
    for level in levels:
        low: Vector = (inner[0], y0, float(level))
        patches += box(low, (inner[1], y1 - 0.006, float(level) + _BOARD_M), paint, object_id=object_id)
    for level in levels[:-1]:
        patches += crockery(*inner, (y0 + y1) / 2, float(level) + _BOARD_M)
    return patches


def _hood(thing: Fixed, object_id: int) -> list[Patch]:
    """A flat canopy of the hood's width, and a chimney on the wall above."""
    (x0, _, z0), (x1, y1, z1) = thing.low, thing.high
    middle = (x0 + x1) / 2
    canopy = box(thing.low, (x1, y1, z0 + _CANOPY_M), _STEEL, object_id=object_id)
    low, high = (middle - _CHIMNEY_M / 2, y1 - _CHIMNEY_M, z0 + _CANOPY_M), (middle + _CHIMNEY_M / 2, y1, z1)
    return canopy + box(low, high, _STEEL, faces="front left right top", object_id=object_id)
