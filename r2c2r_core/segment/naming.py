"""What a thing probably is, from its size, place and handle: a suggestion that a person may change.

The rules are those people build kitchens by: worktops at 0.85-0.95 m, wall units from 1.25 m up, drawers wider than high.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.segment.handles import GridHandle

_WALL_UNIT_M = 1.15  # lower edge; worktops end at 0.95, and nothing hangs closer above them than this
_TALL_M = 1.2
_LONGEST = 6.0  # width over height of a drawer; the edges of worktops and tables are longer
_DARK_GLASS = 0.45


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
    bottom = look.bottom_m if look.bottom_m is not None else 0.1
    if look.height_m > _TALL_M and bottom < 0.5:
        usual = _within(look.height_m, 1.3, 2.1, 0.25) * _within(look.width_m, 0.45, 0.95, 0.12)
        return "refrigerator", usual
    if bottom > _WALL_UNIT_M:
        return "wall_cabinet", _within(look.height_m, 0.3, 1.1, 0.1) * _within(look.width_m, 0.25, 1.0, 0.1)
    usual = _within(look.width_m, 0.22, 0.95, 0.08) * _within(look.height_m, 0.11, 0.9, 0.03)
    usual *= _within(bottom + look.height_m, 0.2, 0.98, 0.08)
    if look.pair:
        return "double_door_cabinet", usual
    lying = look.handle is not None and look.handle.width > 1.8 * look.handle.height
    upright = look.handle is not None and look.handle.height > 1.8 * look.handle.width
    aspect = look.width_m / look.height_m
    usual *= _within(aspect, 0.0, _LONGEST, 1.0)
    if look.height_m < 0.45 and not upright and (aspect > 1.3 or (lying and aspect > 0.8)):
        return "drawer", usual
    machine = lying and 0.42 < look.width_m < 0.66 and look.height_m > 0.5
    if machine and look.dark > _DARK_GLASS:
        return "oven", usual
    return ("dishwasher" if machine else "cabinet"), usual


def name_thing(extent_m: np.ndarray, base_m: float | None) -> str:
    """Category of a free-standing thing of this width, depth and height, standing at this height above the floor."""
    across, height = float(extent_m[:2].max()), float(extent_m[2])
    if base_m is not None and base_m < 0.15:
        if 0.6 < height < 1.25 and 0.3 < across < 0.8:
            return "chair"
        return "bin" if 0.25 < height <= 0.75 and float(extent_m[:2].min()) > 0.15 and across < 0.5 else "object"
    if across < 0.13 and 0.16 < height < 0.40:
        return "bottle"
    return "mug" if across < 0.14 and 0.05 < height <= 0.13 else "object"


def _within(value: float, least: float, most: float, slack: float) -> float:
    """1 inside, falling smoothly to 0 over about twice the slack outside."""
    outside = max(least - value, value - most, 0.0)
    return float(np.exp(-((outside / slack) ** 2)))
