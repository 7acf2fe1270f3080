"""Special units: machines behind fronts, tall units, sliding doors, blind corners."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from r2c2r_core.synthetic.kitchen import Board, Furniture, Handle, Hinge, Leaf, Paint, Style
from r2c2r_core.synthetic.leaves import Place, door_leaf, drawer_leaf, handle_length, plain_handle
from r2c2r_core.synthetic.looks import Look
from r2c2r_core.synthetic.units import Unit, UnitKind, boards_of, carcass_of, furniture_of, plan_unit, rows_of, sides_of

SpecialKind = Literal["dishwasher", "sliding", "tall"]

OVEN_HEIGHT_M, MICROWAVE_HEIGHT_M, BUILT_IN_WIDTH_M = 0.595, 0.382, 0.596  # fronts of built-in machines as sold
_BLACK = (0.020, 0.020, 0.022)
_OVERLAP_M, _TRACK_M = 0.035, 0.026  # of sliding doors: their overlap, and the distance between their faces


def plan_any(kind: UnitKind | SpecialKind, place: Place, style: Style, look: Look, rng: np.random.Generator) -> Unit:
    """A unit of any kind, special or plain."""
    special = _PLANNERS.get(kind)
    return plan_unit(kind, place, style, look, rng) if special is None else special(place, style, look, rng)  # type: ignore[arg-type]


def blind_corner(visible: Unit, hidden_m: float, filler_m: float, on_left: bool, style: Style) -> Unit:
    """The unit with its carcass extended into the corner, and a filler between its front and the next run's."""
    carcass = visible.carcass
    behind = hidden_m + filler_m
    x = carcass.x - behind if on_left else carcass.x
    edge = carcass.x - filler_m if on_left else carcass.x + carcass.width_m
    face = -visible.furniture[0].depth_m
    filler = Board(
        low=(edge, face, carcass.z),
        high=(edge + filler_m, face + style.front_thickness_m, carcass.z + carcass.height_m),
        paint=style.base_front,
    )
    return replace(visible, carcass=replace(carcass, x=x, width_m=carcass.width_m + behind), boards=(*visible.boards, filler))


def _dishwasher(place: Place, style: Style, look: Look, rng: np.random.Generator) -> Unit:
    """A machine behind a unit's front: hinged at the bottom, its handle where a drawer's is."""
    (row,) = rows_of(place, look, style.gap_m, (1.0,))
    left, right = sides_of(place, look, style.gap_m)
    width, height = right - left, row[1] - row[0]
    handle = None
    if look.drawer_handle is not None:
        length = min(handle_length(look.drawer_handle, look), 0.7 * width)
        z = height - float(rng.uniform(0.04, 0.09))
        handle = plain_handle(look.drawer_handle, length, vertical=False, x=width / 2, z=z)
    leaf = Leaf(
        x=left,
        z=row[0],
        width_m=width,
        height_m=height,
        hinge="bottom",
        handle=handle,
        open_limit=round(float(np.radians(rng.uniform(82, 92))), 3),
        frame=look.frame(height, upper=False),
    )
    furniture = (furniture_of("dishwasher", place, (leaf,)),)
    return Unit(furniture=furniture, carcass=carcass_of(place, look, style), boards=boards_of(place, look, style, [row]))


def _sliding(place: Place, style: Style, look: Look, rng: np.random.Generator) -> Unit:
    """Two doors on tracks, the right one behind the left: each slides along the run past the other."""
    low, high = place.bottom + style.gap_m, place.top - style.gap_m
    left, right = place.x + style.gap_m / 2, place.x + place.width_m - style.gap_m / 2
    middle = (left + right) / 2
    front = _sliding_leaf(left, middle + _OVERLAP_M / 2, low, high, look, rng, rightwards=True)
    rear = _sliding_leaf(middle - _OVERLAP_M / 2, right, low, high, look, rng, rightwards=False)
    furniture = (
        furniture_of("sliding_door", place, (front,)),
        Furniture(name="", category="sliding_door", leaves=(rear,), depth_m=place.depth_m - _TRACK_M),
    )
    carcass = carcass_of(place, look, style)
    set_back = style.front_thickness_m + _TRACK_M
    return Unit(furniture=furniture, carcass=replace(carcass, depth_m=place.depth_m - set_back), boards=())


def _sliding_leaf(
    left: float, right: float, low: float, high: float, look: Look, rng: np.random.Generator, *, rightwards: bool
) -> Leaf:
    width, height = right - left, high - low
    x = float(rng.uniform(0.045, 0.07))
    return Leaf(
        x=left,
        z=low,
        width_m=width,
        height_m=height,
        hinge=None,
        slides="right" if rightwards else "left",
        handle=plain_handle("finger", 0.14, vertical=True, x=x if rightwards else width - x, z=height * 0.62),
        open_limit=round(width - _OVERLAP_M - float(rng.uniform(0.0, 0.03)), 3),
        frame=look.frame(height, upper=False),
    )


def _tall(place: Place, style: Style, look: Look, rng: np.random.Generator) -> Unit:
    """Unit up to the wall cabinets' tops: one or two fronts below, an oven, a microwave over it, a door above them."""
    gap = style.gap_m
    left, right = place.x + gap / 2, place.x + place.width_m - gap / 2
    spare = place.top - place.bottom - OVEN_HEIGHT_M - MICROWAVE_HEIGHT_M - 3 * gap
    below = spare * float(rng.uniform(0.50, 0.62))
    levels = np.cumsum([place.bottom, below, gap + OVEN_HEIGHT_M, gap + MICROWAVE_HEIGHT_M])
    bottom = drawer_leaf(left, right, (place.bottom, levels[1]), place, look, rng)
    oven = _machine(left, right, float(levels[1]) + gap, OVEN_HEIGHT_M, "bottom", "oven_front", rng)
    microwave = _machine(left, right, float(levels[2]) + gap, MICROWAVE_HEIGHT_M, "left", "microwave_front", rng)
    hinge: Hinge = "left" if rng.random() < 0.5 else "right"
    above = replace(place, upper=True)
    top = door_leaf(left, right, (float(levels[3]) + gap, place.top), hinge, above, replace(look, filling="panel"), rng)
    furniture = (
        furniture_of("drawer", place, (bottom,)),
        furniture_of("oven", place, (oven,)),
        furniture_of("microwave", place, (microwave,)),
        furniture_of("cabinet", place, (top,)),
    )
    return Unit(furniture=furniture, carcass=carcass_of(place, look, style), boards=())


def _machine(left: float, right: float, low: float, height: float, hinge: Hinge, kind: str, rng: np.random.Generator) -> Leaf:
    """A built-in machine's front, with a handle along its upper edge or down the edge beside its controls."""
    width = right - left
    steel = float(rng.uniform(0.42, 0.55))
    colour = _BLACK if rng.random() < 0.5 else (steel, steel, 1.02 * steel)
    limit = np.radians(rng.uniform(85, 92)) if hinge == "bottom" else np.radians(rng.uniform(95, 115))
    handle = Handle(
        kind="bar",
        length_m=0.8 * width if hinge == "bottom" else 0.7 * height,
        thickness_m=0.016,
        reach_m=0.042,
        vertical=hinge != "bottom",
        x=width / 2 if hinge == "bottom" else 0.74 * width,
        z=0.78 * height if hinge == "bottom" else height / 2,
    )
    return Leaf(
        x=left,
        z=low,
        width_m=width,
        height_m=height,
        hinge=hinge,
        handle=handle,
        open_limit=round(float(limit), 3),
        look=Paint(kind=kind, colour=colour, accent=(0.6, 0.6, 0.6), gloss=0.6, texel_m=0.0012),
    )


_PLANNERS: dict[str, Callable[[Place, Style, Look, np.random.Generator], Unit]] = {
    "dishwasher": _dishwasher,
    "sliding": _sliding,
    "tall": _tall,
}
