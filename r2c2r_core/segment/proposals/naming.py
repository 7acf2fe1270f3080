"""Category suggestion from size, place, handle and glass: the likeliest of the category table; a person may change it."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.kitchen.categories import every_category
from r2c2r_core.kitchen.category import Category, Place
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.mosaics.handles import GridHandle
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How much a front's look says of what it is."""

    long: float = param(1.8, "ratio", "of the sides of a bar handle")
    as_usual: float = param(
        0.85,
        "share",
        "of bars that lie as on most fronts of their kind",
        source="own estimate: doors with level bars are sold",
    )
    dark_share: float = param(0.45, "share", "of a front that is dark, from where it is dark glass")
    glass: float = param(
        0.8, "share", "of ovens' fronts that are darker than that, and of others that are not", source="own estimate"
    )
    bare: float = param(
        0.3,
        "ratio",
        "of ovens and dishwashers on which no handle is seen, to other fronts on which none is",
        source="own estimate: kitchens without handles have machines with them",
    )
    plinth_m: float = param(0.1, "m", "from the floor to a front where no floor was found", source="plinths of 6-20 cm")
    worktop_m: float = param(0.9, "m", "from the floor to a thing where no floor was found", source="EN 1116")


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontLook:
    """A panel as it looks. Heights are above the floor, None where no floor was found."""

    width_m: float
    height_m: float
    bottom_m: float | None
    handle: GridHandle | None
    dark: float = 0.0  # share of it that is dark and without texture, as glass is
    pair: bool = False  # two doors that open away from each other


def name_front(look: FrontLook, *, machines: bool = True) -> tuple[str, float]:
    """The likeliest category, of machines or without them, and how usual its size is (0..1) where it is."""
    fronts = [
        kind
        for kind, place in _proposed()
        if (kind.kind == "front" or (kind.kind == "appliance" and place.holds(0.0)))  # what stands on a worktop is in no run
        if (kind.opens == "pair") == look.pair
    ]
    kinds = [kind for kind in fronts if machines or not kind.one_front]
    best = max(kinds, key=lambda kind: _log_posterior(kind, look))
    return best.name, best.width.fit(look.width_m) * best.height.fit(look.height_m) * _place_fit(best, look)


def name_thing(extent_m: np.ndarray, base_m: float | None) -> str:
    """Category of a free-standing thing of this width, depth and height, standing at this height above the floor."""
    across, height = float(extent_m[:2].max()), float(extent_m[2])
    base_m = tuned(Params).worktop_m if base_m is None else base_m
    fitting = [
        kind
        for kind, place in _proposed()
        if kind.kind == "thing" and place.holds(base_m)
        if kind.width.holds(across) and kind.depth.holds(float(extent_m[:2].min())) and kind.height.holds(height)
    ]
    if not fitting:
        return category_of("object").name
    return max(fitting, key=lambda kind: kind.width.log_likelihood(across) + kind.height.log_likelihood(height)).name


def _proposed() -> list[tuple[Category, Place]]:
    return [(kind, kind.place) for kind in every_category() if kind.place is not None]


def _log_posterior(kind: Category, look: FrontLook) -> float:
    """Log of how often a kitchen has such a front, times the likelihoods of its sizes, place, handle and glass."""
    params = tuned(Params)
    assert kind.place is not None  # of what is proposed
    known = np.log(kind.place.per_kitchen) + kind.width.log_likelihood(look.width_m) + kind.height.log_likelihood(look.height_m)
    bar = look.handle is not None and max(look.handle.width, look.handle.height) > params.long * min(
        look.handle.width, look.handle.height
    )
    lies = look.handle is not None and look.handle.width > look.handle.height
    said = np.log(_share(lies == kind.handle_lies, params.as_usual)) if bar else 0.0
    bare = np.log(params.bare) if look.handle is None and kind.one_front else 0.0
    dark = np.log(_share((look.dark > params.dark_share) == kind.dark, params.glass))
    return float(known + said + bare + dark + np.log(max(_place_fit(kind, look), 1e-9)))


def _place_fit(kind: Category, look: FrontLook) -> float:
    bottom = look.bottom_m if look.bottom_m is not None else tuned(Params).plinth_m
    assert kind.place is not None
    return kind.place.fit(bottom, bottom + look.height_m)


def _share(usual: bool, probability: float) -> float:
    return probability if usual else 1 - probability
