"""Category suggestion from size, place and handle; a person may change it.

Where it stands says which kinds it may be, and the category table how large those are: worktops end at 0.85-0.95 m, wall
units hang from 1.25 m up, drawers are wider than high.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.runs.handles import GridHandle

_WALL_UNIT_M = 1.15  # lower edge; worktops end at 0.95, and nothing hangs closer above them than this
_WORKTOP_M = 0.95  # EN 1116: working heights of 850 and 900 mm; tall people ask for more
_TALL_M, _STANDS_M, _PLINTH_M = 1.2, 0.5, 0.1
_TALL, _HUNG = "refrigerator", "wall_cabinet"
_LONGEST = 6.0  # width over height of a drawer; the edges of worktops and tables are longer
_LONG = 1.8  # sides of a bar
_DARK_GLASS = 0.45
_ON_FLOOR_M = 0.15
_FLOOR_THINGS, _TABLE_THINGS = ("chair", "bin"), ("bottle", "mug")


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontLook:
    """A panel as it looks. Heights are above the floor, None where no floor was found."""

    width_m: float
    height_m: float
    bottom_m: float | None
    handle: GridHandle | None
    dark: float = 0.0  # share of it that is dark and without texture, as glass is
    pair: bool = False  # two doors that open away from each other


def name_front(look: FrontLook) -> tuple[str, float]:
    """Category, and how usual its size is (0..1) where it is."""
    bottom = look.bottom_m if look.bottom_m is not None else _PLINTH_M
    name = _front_there(look, bottom)
    category = category_of(name)
    usual = category.width.fit(look.width_m) * category.height.fit(look.height_m)
    if name not in (_TALL, _HUNG):  # in the run below the worktop
        usual *= _below(bottom + look.height_m, _WORKTOP_M) * _below(look.width_m / look.height_m, _LONGEST)
    return name, usual


def _front_there(look: FrontLook, bottom_m: float) -> str:
    """What a panel at a height above the floor is, by its handle, its shape and its glass."""
    if look.height_m > _TALL_M and bottom_m < _STANDS_M:
        return _TALL
    if bottom_m > _WALL_UNIT_M:
        return _HUNG
    if look.pair:
        return "double_door_cabinet"
    lying = look.handle is not None and look.handle.width > _LONG * look.handle.height
    upright = look.handle is not None and look.handle.height > _LONG * look.handle.width
    aspect = look.width_m / look.height_m
    if category_of("drawer").height.holds(look.height_m) and not upright and (aspect > 1.3 or (lying and aspect > 0.8)):
        return "drawer"
    machine = category_of("dishwasher")
    if lying and machine.width.holds(look.width_m) and machine.height.holds(look.height_m):
        return "oven" if look.dark > _DARK_GLASS else "dishwasher"
    return "cabinet"


def name_thing(extent_m: np.ndarray, base_m: float | None) -> str:
    """Category of a free-standing thing of this width, depth and height, standing at this height above the floor."""
    across, height = float(extent_m[:2].max()), float(extent_m[2])
    for name in _FLOOR_THINGS if base_m is not None and base_m < _ON_FLOOR_M else _TABLE_THINGS:
        category = category_of(name)
        if category.width.holds(across) and category.depth.holds(float(extent_m[:2].min())) and category.height.holds(height):
            return name
    return category_of("object").name


def _below(value: float, most: float) -> float:
    """1 up to a value, falling smoothly to 0 over about a fifth of it beyond."""
    return float(np.exp(-((max(value / most - 1.0, 0.0) / 0.1) ** 2)))
