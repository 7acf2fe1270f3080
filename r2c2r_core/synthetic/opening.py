"""What stands open in the later part of a recording: one drawer and one door, each at its stop."""

from collections.abc import Mapping

import numpy as np

from r2c2r_core.synthetic.kitchen import Carcass, Furniture, Kitchen, Leaf, Paint, Run
from r2c2r_core.synthetic.patches import Patch, box, shifted, turned

OPENED_FROM = 0.55  # of the recording: on the way back along the run
_TRAY_WALL_M, _TRAY_HEIGHT, _TRAY_SPARE_M = 0.013, 0.6, 0.05


def opened_units(kitchen: Kitchen) -> dict[str, float]:
    """Name and opening (metres, radians) of a drawer and a single door of the base run, as far apart as it has them."""
    drawers = [f for f in kitchen.base if f.category == "drawer"]
    doors = [f for f in kitchen.base if f.category == "cabinet"]
    if not drawers or not doors:
        return {f.name: f.leaves[0].open_limit for f in (drawers[:1] or doors[:1])}
    pairs = [(a, b) for a in drawers for b in doors]
    drawer, door = max(pairs, key=lambda pair: abs(pair[0].leaves[0].x - pair[1].leaves[0].x))
    return {f.name: f.leaves[0].open_limit for f in (drawer, door)}


def opened_front(
    furniture: Furniture, front: list[Patch], opening: float, thickness_m: float, inside: Paint, object_id: int
) -> list[Patch]:
    """The front (panel and handle) where it stands opened, with its back, and a drawer's tray."""
    leaf, face = furniture.leaves[0], -furniture.depth_m
    back = face + thickness_m
    low, high = (leaf.x, back - 0.001, leaf.z), (leaf.x + leaf.width_m, back, leaf.z + leaf.height_m)
    moving = [*front, *box(low, high, inside, faces="back", object_id=object_id)]
    if leaf.hinge is None:
        moving += _tray(leaf, back, back + opening + _TRAY_SPARE_M, inside, object_id)
        return shifted(moving, np.array([0.0, -opening, 0.0]))
    edge = leaf.x if leaf.hinge == "left" else leaf.x + leaf.width_m
    return turned(moving, -opening if leaf.hinge == "left" else opening, (edge, face))


def hollow(low: tuple[float, float, float], high: tuple[float, float, float], inside: Paint) -> list[Patch]:
    """The inner walls of a box open at the front."""
    return box(high, low, inside, faces="front left right top bottom")  # corners swapped: each wall faces inwards


def holds_opened(carcass: Carcass, run: Run, opened: Mapping[str, float]) -> bool:
    """Whether a carcass of the run stands behind an opened front."""
    middles = [f.leaves[0].x + f.leaves[0].width_m / 2 for f in run.base if f.name in opened]
    return any(carcass.x < middle < carcass.x + carcass.width_m for middle in middles)


def _tray(leaf: Leaf, front_y: float, back_y: float, inside: Paint, object_id: int) -> list[Patch]:
    low = (leaf.x + 0.02, front_y, leaf.z + 0.02)
    high = (leaf.x + leaf.width_m - 0.02, back_y, leaf.z + 0.02 + _TRAY_HEIGHT * (leaf.height_m - 0.02))
    wall = _TRAY_WALL_M
    inner_low, inner_high = (low[0] + wall, low[1], low[2] + wall), (high[0] - wall, high[1] - wall, high[2])
    outer = box(low, high, inside, faces="left right bottom back", object_id=object_id)
    return outer + box(inner_high, inner_low, inside, faces="front left right top", object_id=object_id)
