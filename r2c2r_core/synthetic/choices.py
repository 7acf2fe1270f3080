"""Styles, palettes and layouts of synthetic kitchens that a person can choose, by name."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

STYLES: Mapping[str, str] = MappingProxyType(
    {
        "slab": "flat fronts with a bar, bow or flat handle",
        "shaker": "a frame of four rails round a sunk panel",
        "framed": "fronts inset in a face frame, with knobs",
        "handleless": "channels to reach into over the fronts, no handle",
        "push": "flat fronts with nothing on them: pushed to open",
        "glass": "wall cabinets of framed glass, clear or frosted",
        "cup": "cup pulls on drawers, knobs on doors",
        "knobs": "a knob on every front, flat or framed",
    }
)
PALETTES: Mapping[str, str] = MappingProxyType(
    {
        "painted": "one matt colour",
        "wood": "veneer with its grain, from ash to walnut",
        "dark": "black and near it, high gloss: depth sensors get little back",
        "white": "white on white: fronts, worktop, plinth and wall",
        "two-tone": "wall cabinets in another colour than the units below",
    }
)
LAYOUTS: Mapping[str, str] = MappingProxyType(
    {
        "straight": "one run along a wall",
        "l": "round a blind corner, with a tall unit of oven and microwave, a dishwasher and a hob under its hood",
        "galley": "two runs face to face, with sliding doors, an open shelf and a refrigerator of french doors",
        "island": "one run, and an island before it with fronts on both sides",
    }
)
DEFAULT_STYLE, DEFAULT_LAYOUT = "slab", "straight"


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A person's choice of style, palette and layout; an empty one gives the seed's own kitchen."""

    style: str | None = None  # of STYLES
    palette: str | None = None  # of PALETTES
    layout: str | None = None  # of LAYOUTS


SEEDS_OWN = Choice()
