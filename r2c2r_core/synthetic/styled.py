"""Random kitchen of a seed in a chosen style, palette and layout."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.synthetic.choices import DEFAULT_LAYOUT, DEFAULT_STYLE, Choice
from r2c2r_core.synthetic.kitchen import Appliance, Furniture, Kitchen, Run
from r2c2r_core.synthetic.layout import fill_worktop, hang_on_wall, place_fridge, place_microwave, plan_kitchen
from r2c2r_core.synthetic.looks import pick_look
from r2c2r_core.synthetic.palettes import repaint
from r2c2r_core.synthetic.style import pick_style
from r2c2r_core.synthetic.units import Unit, UnitKind
from r2c2r_core.synthetic.wings import (
    AnyKind,
    Kit,
    Measures,
    corner_wing,
    island,
    named,
    opposite_wing,
    plan_corner,
    plan_row,
    plan_upper_row,
    right_end,
    standing,
)

Room = tuple[float, float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rest:
    """The further runs of a layout, and the extent that the room needs for them."""

    wings: tuple[Run, ...] = ()
    x_max: float | None = None  # x of a wall; None: anywhere beyond the main run
    y_min: float | None = None


def plan_styled_kitchen(seed: int, choice: Choice) -> Kitchen:
    """The kitchen of a seed with these choices, of which a palette changes the paints only."""
    if choice.style is None and choice.layout is None:
        own = plan_kitchen(seed)
        return replace(own, style=repaint(own.style, choice.palette, seed))
    rng, layout = np.random.default_rng([seed, 9]), choice.layout or DEFAULT_LAYOUT
    paints = repaint(pick_style(rng)[0], choice.palette, seed)
    look, measures = pick_look(choice.style or DEFAULT_STYLE, rng), _pick_measures(rng)
    kit = Kit(measures=measures, style=paints, look=look)
    base = plan_row(_base_kinds(rng), kit, rng)
    rest = _Rest()
    if layout == "l":
        base, rest = _with_corner(base, kit, np.random.default_rng([seed, 10]))
    right = right_end(base)
    fridge_left = bool(rng.random() < 0.5) or layout == "l"
    upper = plan_upper_row(0.0, right, _upper_kinds(rng), kit, rng)
    fridge = place_fridge(rng, right, fridge_left)
    if layout == "galley":
        fridge = _with_french_doors(fridge, np.random.default_rng([seed, 11]))
    microwave = None if layout == "l" else place_microwave(rng, right, measures.worktop_top)
    lower_units, upper_units = _shown_ends(base), _shown_ends(upper)
    props, bottles = fill_worktop(rng, right, microwave, lower_units, measures.depth)
    if layout in ("l", "island"):
        props = tuple(prop for prop in props if prop.kind != "hob")  # the hob is on the other run
    main = standing(base, upper, (0.0 if fridge_left else -0.01, right + (0.01 if fridge_left and layout != "l" else 0.0)))
    main = replace(main, base=lower_units, upper=upper_units, props=(*props, *hang_on_wall(rng, right, upper_units)))
    if layout in ("galley", "island"):
        rest = _across(layout, right, kit, np.random.default_rng([seed, 10]))
    room = _pick_room(right, fridge, fridge_left, rest, rng)
    return Kitchen(
        style=paints,
        runs=named((main, *rest.wings)),
        plinth_m=measures.plinth,
        worktop_top_m=measures.worktop_top,
        worktop_thickness_m=measures.worktop_thickness,
        base_depth_m=measures.depth,
        upper_depth_m=measures.upper_depth,
        fridge=fridge,
        microwave=microwave,
        bottles=bottles,
        room=room,
        window_on_left=layout == "l" or not fridge_left,
        yaw_rad=float(rng.uniform(-np.pi, np.pi)),
    )


def _pick_measures(rng: np.random.Generator) -> Measures:
    plinth, worktop_top = float(rng.uniform(0.07, 0.17)), float(rng.uniform(0.86, 0.95))
    thickness = float(rng.uniform(0.014, 0.045))
    upper_bottom = worktop_top + float(rng.uniform(0.45, 0.60))
    return Measures(
        plinth=plinth,
        bottom=plinth + 0.002,
        top=worktop_top - thickness - float(rng.uniform(0.003, 0.012)),
        worktop_top=worktop_top,
        worktop_thickness=thickness,
        depth=float(rng.uniform(0.54, 0.66)),
        upper_bottom=upper_bottom,
        upper_top=upper_bottom + float(rng.uniform(0.55, 0.88)),
        upper_depth=float(rng.uniform(0.29, 0.41)),
    )


def _base_kinds(rng: np.random.Generator) -> list[AnyKind]:
    """A stack of drawers, two doors, and one or two of any kind, in random order."""
    more: tuple[UnitKind, ...] = ("door", "double", "drawers")
    kinds: list[AnyKind] = ["drawers", "door", "door"]
    kinds += [more[int(rng.integers(3))] for _ in range(int(rng.integers(1, 3)))]
    rng.shuffle(kinds)
    return kinds


def _upper_kinds(rng: np.random.Generator) -> list[UnitKind]:
    """Two to four wall cabinets."""
    return ["double" if rng.random() < 0.25 else "door" for _ in range(int(rng.integers(2, 5)))]


def _with_corner(base: list[Unit], kit: Kit, rng: np.random.Generator) -> tuple[list[Unit], _Rest]:
    """The main row with a blind unit at its right end, and the wing that starts beside it."""
    corner, filler = plan_corner(right_end(base), kit, rng)
    x_max = corner.carcass.x + corner.carcass.width_m
    wing = corner_wing(x_max, filler, kit, rng)
    length = max(wing.ends[1], max(c.x + c.width_m for c in wing.base_carcasses))
    return [*base, corner], _Rest(wings=(wing,), x_max=x_max, y_min=wing.place[1] - length - float(rng.uniform(1.0, 1.5)))


def _across(layout: str, right: float, kit: Kit, rng: np.random.Generator) -> _Rest:
    """The part in front of the main run: a second run on the wall opposite, or an island with space to walk around it."""
    if layout == "galley":
        wing = opposite_wing(right, kit, rng)
        return _Rest(wings=(wing,), y_min=wing.place[1])
    wings = island(right, kit, rng)
    return _Rest(wings=wings, y_min=wings[0].place[1] - kit.measures.depth - float(rng.uniform(2.1, 2.4)))


def _pick_room(right: float, fridge: Appliance, fridge_left: bool, rest: _Rest, rng: np.random.Generator) -> Room:
    """Room bounds slightly beyond everything, or where the layout puts them."""
    beside = fridge.size_m[0] + 0.04
    x_min = -(beside if fridge_left else 0.0) - float(rng.uniform(0.05, 0.9))
    x_max = right + (0.0 if fridge_left else beside) + float(rng.uniform(0.05, 0.9))
    y_min = -float(rng.uniform(3.7, 4.3))
    for wing in rest.wings:
        ends = wing.kitchen_from_run.apply(np.array([[x, 0.0, 0.0] for x in wing.ends]))[:, 0]
        x_min, x_max = min(x_min, float(ends.min()) - 1.15), max(x_max, float(ends.max()) + 1.15)
    return (
        x_min,
        x_max if rest.x_max is None else rest.x_max,
        y_min if rest.y_min is None else rest.y_min,
        0.0,
        float(rng.uniform(2.45, 2.7)),
    )


def _with_french_doors(fridge: Appliance, rng: np.random.Generator) -> Appliance:
    """The refrigerator, wider, with two doors over a freezer drawer."""
    width, height = float(rng.uniform(0.80, 0.92)), float(rng.uniform(1.72, 1.85))
    (x, y, _), (old_width, depth, _) = fridge.centre, fridge.size_m
    aside = (width - old_width) / 2 * (1 if x > 0 else -1)
    return replace(
        fridge,
        category="french_door_refrigerator",
        centre=(x + aside, y, height / 2),
        size_m=(width, depth, height),
        door_width_m=width,
        drawer_m=float(rng.uniform(0.52, 0.70)),
        handle=replace(fridge.handle, z=1.15),
    )


def _shown_ends(units: list[Unit]) -> tuple[Furniture, ...]:
    """The row's furniture; doors at its ends show their outer side."""
    furniture = [list(unit.furniture) for unit in units]
    if len(furniture[0]) == 1:
        furniture[0][0] = replace(furniture[0][0], shows_left_side=True)
    if len(furniture[-1]) == 1:
        furniture[-1][0] = replace(furniture[-1][0], shows_right_side=True)
    return tuple(each for unit in furniture for each in unit)
