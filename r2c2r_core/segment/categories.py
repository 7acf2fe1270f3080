"""What a category's name says about how to segment it. Names are free text: unknown ones are things."""

import re
from dataclasses import dataclass, field
from typing import Literal

from r2c2r_core.segment.appliances import ApplianceSize
from r2c2r_core.segment.things import ThingConfig
from r2c2r_core.segment.units import FrontSize

Kind = Literal["front", "appliance", "thing"]


@dataclass(frozen=True, slots=True, kw_only=True)
class CategoryHint:
    """How to look for an object of a category."""

    kind: Kind
    pair: bool = False  # two doors side by side are one object
    size: FrontSize | None = None  # of a unit's whole front: a machine, a stack of drawers
    stacked: bool = False  # one of a stack of drawers
    depth_m: float = 0.58  # usual distance from the front to the back
    appliance: ApplianceSize | None = None
    thing: ThingConfig = field(default_factory=lambda: ThingConfig(radius_m=0.2))


_FRONTS = {"drawer", "cabinet", "door", "cupboard", "oven", "range", "dishwasher", "stove", "washer", "sink"}
_FRONTS |= {"panel", "filler", "plinth", "kickboard"}  # nothing behind them opens, but they are cut like fronts
_UNITS = {  # one front whatever lines it carries
    **dict.fromkeys(("oven", "range", "stove"), FrontSize(width=(0.42, 0.6, 1.0), height=(0.38, 0.68, 0.95))),
    "dishwasher": FrontSize(width=(0.38, 0.6, 0.68), height=(0.5, 0.74, 0.92)),
    "stack": FrontSize(width=(0.25, 0.55, 1.25), height=(0.35, 0.72, 0.95)),
    "washer": FrontSize(width=(0.5, 0.6, 0.75), height=(0.65, 0.82, 1.0)),
}
_FRIDGE = ApplianceSize(width=(0.42, 0.65, 1.25), height=(0.75, 1.7, 2.2), depth=0.64, spread=0.35)
_APPLIANCES = {
    **dict.fromkeys(("refrigerator", "fridge", "freezer"), _FRIDGE),
    "microwave": ApplianceSize(width=(0.36, 0.50, 0.72), height=(0.21, 0.29, 0.46), depth=0.38),
    "hood": ApplianceSize(width=(0.4, 0.6, 1.2), height=(0.05, 0.3, 1.0), depth=0.4, spread=0.5),
}
APPLIANCE_SIZES = tuple(dict.fromkeys(_APPLIANCES.values()))
_RADII_M = {  # half the largest side
    **dict.fromkeys(("mug", "cup", "glass", "can", "jar", "bowl"), 0.065),
    **dict.fromkeys(("bottle", "carafe", "vase"), 0.16),
    **dict.fromkeys(("kettle", "toaster", "pot", "pan", "blender", "plant"), 0.2),
    **dict.fromkeys(("box", "book", "bag"), 0.18),
    **dict.fromkeys(("chair", "stool", "bin", "trash"), 0.5),
    **dict.fromkeys(("shelf", "shelve", "bookcase", "bookshelf", "rack"), 0.6),
    **dict.fromkeys(("table", "sofa", "desk", "bench", "counter", "worktop", "countertop"), 1.0),
}
_ROUND_WIDTHS_M = {
    **dict.fromkeys(("mug", "cup", "glass", "jar"), 0.085),
    **dict.fromkeys(("bottle", "can"), 0.075),
    **dict.fromkeys(("carafe", "vase", "bowl"), 0.12),
}
_ON_FLOOR = {"chair", "stool", "table", "sofa", "desk", "bench", "bin", "trash"}


def hint_for(category: str) -> CategoryHint:
    """The hint for a category as a person wrote it."""
    words = re.findall(r"[a-z]+", category.lower())
    stems = {word for word in words} | {word.removesuffix("s") for word in words}
    for stem in sorted(stems & set(_APPLIANCES)):
        size = _APPLIANCES[stem]
        return CategoryHint(
            kind="appliance", depth_m=size.depth, appliance=size, thing=ThingConfig(radius_m=size.width[1] * 0.7)
        )
    if stems & _FRONTS:
        wall = bool(stems & {"wall", "upper", "hanging"})
        units = [_UNITS[stem] for stem in sorted(stems) if stem in _UNITS]
        return CategoryHint(
            kind="front",
            pair="double" in stems or "sink" in stems,
            size=units[0] if units else None,
            stacked="drawer" in stems and "stack" not in stems,
            depth_m=0.35 if wall else 0.58,
        )
    named = [_RADII_M[stem] for stem in sorted(stems) if stem in _RADII_M]
    radius = named[0] if named else 0.2
    widths = [_ROUND_WIDTHS_M[stem] for stem in sorted(stems) if stem in _ROUND_WIDTHS_M]
    thing = ThingConfig(
        radius_m=radius, width_m=widths[0] if widths else None, round=bool(widths), on_floor=bool(stems & _ON_FLOOR)
    )
    return CategoryHint(kind="thing", thing=thing)
