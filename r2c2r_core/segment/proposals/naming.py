"""Category suggestion from size, place and handle; a person may change it.

Where it stands says which kinds it may be, and the category table how large those are: worktops end at 0.85-0.95 m, wall
units hang from 1.25 m up, drawers are wider than high.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.runs.handles import GridHandle
from r2c2r_core.tuning import param, tuned

_TALL, _HUNG = "refrigerator", "wall_cabinet"
_FLOOR_THINGS, _TABLE_THINGS = ("chair", "bin"), ("bottle", "mug")


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What a front is called by size and place."""

    wall_unit_m: float = param(
        1.15,
        "m",
        "lower edge, from which it hangs",
        source="worktops end at 0.95, and nothing hangs closer above them than this",
    )
    worktop_m: float = param(
        0.95,
        "m",
        "greatest upper edge of what is below a worktop",
        source="EN 1116: working heights of 850 and 900 mm; tall people ask for more",
    )
    longest: float = param(6.0, "ratio", "of width to height of a drawer", source="the edges of worktops and tables are longer")
    long: float = param(1.8, "ratio", "of the sides of a bar handle")
    dark_glass: float = param(0.45, "share", "of a front that is dark, from where it is an oven's")
    wide: float = param(1.3, "ratio", "of width to height of a drawer")
    wide_lying: float = param(0.8, "ratio", "of width to height of a drawer whose handle lies")
    beyond: float = param(0.1, "ratio", "beyond a bound, at which little of a name is left", gt=0)
    on_floor_m: float = param(0.15, "m", "above the floor, within which a thing stands on it")
    tall_m: float = param(1.2, "m", "height from which a front is a refrigerator's")
    stands_m: float = param(0.5, "m", "above the floor, within which an appliance stands on it")
    plinth_m: float = param(0.1, "m", "height of a plinth")


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
    params = tuned(Params)
    bottom = look.bottom_m if look.bottom_m is not None else params.plinth_m
    name = _front_there(look, bottom)
    category = category_of(name)
    usual = category.width.fit(look.width_m) * category.height.fit(look.height_m)
    if name not in (_TALL, _HUNG):  # in the run below the worktop
        usual *= _below(bottom + look.height_m, params.worktop_m) * _below(look.width_m / look.height_m, params.longest)
    return name, usual


def _front_there(look: FrontLook, bottom_m: float) -> str:
    """What a panel at a height above the floor is, by its handle, its shape and its glass."""
    params = tuned(Params)
    if look.height_m > params.tall_m and bottom_m < params.stands_m:
        return _TALL
    if bottom_m > params.wall_unit_m:
        return _HUNG
    if look.pair:
        return "double_door_cabinet"
    lying = look.handle is not None and look.handle.width > params.long * look.handle.height
    upright = look.handle is not None and look.handle.height > params.long * look.handle.width
    aspect = look.width_m / look.height_m
    if (
        category_of("drawer").height.holds(look.height_m)
        and not upright
        and (aspect > params.wide or (lying and aspect > params.wide_lying))
    ):
        return "drawer"
    machine = category_of("dishwasher")
    if lying and machine.width.holds(look.width_m) and machine.height.holds(look.height_m):
        return "oven" if look.dark > params.dark_glass else "dishwasher"
    return "cabinet"


def name_thing(extent_m: np.ndarray, base_m: float | None) -> str:
    """Category of a free-standing thing of this width, depth and height, standing at this height above the floor."""
    params = tuned(Params)
    across, height = float(extent_m[:2].max()), float(extent_m[2])
    for name in _FLOOR_THINGS if base_m is not None and base_m < params.on_floor_m else _TABLE_THINGS:
        category = category_of(name)
        if category.width.holds(across) and category.depth.holds(float(extent_m[:2].min())) and category.height.holds(height):
            return name
    return category_of("object").name


def _below(value: float, most: float) -> float:
    """1 up to a value, falling smoothly to 0 over about a fifth of it beyond."""
    return float(np.exp(-((max(value / most - 1.0, 0.0) / tuned(Params).beyond) ** 2)))
