"""Category suggestion from size, place, handle and glass: the most probable of the table; a person may change it."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.kitchen.categories import every_category
from r2c2r_core.kitchen.category import Category, Place
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.mosaics.handles import GridHandle
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters (likelihoods) of a front's appearance."""

    long: float = param(1.8, "ratio", "Minimum aspect ratio of a bar handle")
    as_usual: float = param(
        0.85,
        "share",
        "Fraction of bars oriented as on most fronts of their category",
        source="own estimate: doors with level bars are sold",
    )
    dark_share: float = param(0.45, "share", "Fraction of dark area above which a front is dark glass")
    glass: float = param(
        0.8, "share", "Fraction of ovens' fronts that are darker than that, and of others that are not", source="own estimate"
    )
    bare: float = param(
        0.3,
        "ratio",
        "Ratio of ovens and dishwashers without a visible handle to other fronts without one",
        source="own estimate: kitchens without handles have machines with them",
    )
    plinth_m: float = param(0.1, "m", "Height of a front above the floor where no floor was found", source="plinths of 6-20 cm")
    worktop_m: float = param(0.9, "m", "Height of an object above the floor where no floor was found", source="EN 1116")


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontLook:
    """Appearance of a panel. Heights are above the floor, None where no floor was found."""

    width_m: float
    height_m: float
    bottom_m: float | None
    handle: GridHandle | None
    dark: float = 0.0  # fraction of it that is dark and without texture, as glass is
    pair: bool = False  # two doors that open away from each other


def name_front(look: FrontLook, *, machines: bool = True) -> tuple[str, float]:
    """Most probable category, with or without machines, and how usual its size is there (0..1)."""
    fronts = [
        kind
        for kind, place in _proposed()
        if (kind.kind == "front" or (kind.kind == "appliance" and place.holds(0.0)))  # appliances on a worktop are in no run
        if (kind.opens == "pair") == look.pair
    ]
    kinds = [kind for kind in fronts if machines or not kind.one_front]
    best = max(kinds, key=lambda kind: _log_posterior(kind, look))
    return best.name, best.width.fit(look.width_m) * best.height.fit(look.height_m) * _place_fit(best, look)


def name_thing(extent_m: np.ndarray, base_m: float | None) -> str:
    """Category of a free-standing object with this width, depth and height, at this height above the floor."""
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
    """Log posterior: frequency of such a front in a kitchen times the likelihoods of its sizes, place, handle and glass."""
    params = tuned(Params)
    assert kind.place is not None  # holds for all proposed categories
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
