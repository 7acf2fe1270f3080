"""Which kitchen a seed gives in a style, a palette and a layout of one's choice."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.synthetic.choices import DEFAULT_STYLE, Choice
from r2c2r_core.synthetic.kitchen import Furniture, Kitchen, Run, Style
from r2c2r_core.synthetic.layout import fill_worktop, hang_on_wall, place_fridge, place_microwave
from r2c2r_core.synthetic.looks import Look, pick_look
from r2c2r_core.synthetic.palettes import repaint
from r2c2r_core.synthetic.style import pick_style
from r2c2r_core.synthetic.units import Place, Unit, UnitKind, named, plan_unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """Heights and depths that all units of a kitchen share, metres."""

    plinth: float
    bottom: float
    top: float  # of the carcasses
    worktop_top: float
    worktop_thickness: float
    depth: float
    upper_bottom: float
    upper_top: float
    upper_depth: float


def plan_styled_kitchen(seed: int, choice: Choice) -> Kitchen:
    """The kitchen of a seed, made as chosen; what was not chosen is the seed's own, and slabs."""
    rng = np.random.default_rng([seed, 9])
    paints, _ = pick_style(rng)
    if choice.palette is not None:
        paints = repaint(paints, choice.palette, rng)
    look, measures = pick_look(choice.style or DEFAULT_STYLE, rng), _pick_measures(rng)
    counts: dict[str, int] = {}
    base = named(_plan_row(_base_kinds(rng), measures, paints, look, rng), counts)
    right = base[-1].carcass.x + base[-1].carcass.width_m
    fridge_left = bool(rng.random() < 0.5)
    upper = named(_plan_upper_row(right, measures, paints, look, rng), counts)
    fridge = place_fridge(rng, right, fridge_left)
    microwave = place_microwave(rng, right, measures.worktop_top)
    lower_units, upper_units = _shown_ends(base), _shown_ends(upper)
    props, bottles = fill_worktop(rng, right, microwave, lower_units, measures.depth)
    run = Run(
        base=lower_units,
        upper=upper_units,
        base_carcasses=tuple(unit.carcass for unit in base),
        upper_carcasses=tuple(unit.carcass for unit in upper),
        ends=(0.0 if fridge_left else -0.01, right + (0.01 if fridge_left else 0.0)),
        boards=tuple(board for unit in (*base, *upper) for board in unit.boards),
        props=(*props, *hang_on_wall(rng, right, upper_units)),
    )
    beside = fridge.size_m[0] + 0.04
    x_min = -(beside if fridge_left else 0.0) - float(rng.uniform(0.05, 0.9))
    x_max = right + (0.0 if fridge_left else beside) + float(rng.uniform(0.05, 0.9))
    return Kitchen(
        style=paints,
        runs=(run,),
        plinth_m=measures.plinth,
        worktop_top_m=measures.worktop_top,
        worktop_thickness_m=measures.worktop_thickness,
        base_depth_m=measures.depth,
        upper_depth_m=measures.upper_depth,
        fridge=fridge,
        microwave=microwave,
        bottles=bottles,
        room=(x_min, x_max, -float(rng.uniform(3.7, 4.3)), 0.0, float(rng.uniform(2.45, 2.7))),
        window_on_left=not fridge_left,
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


def _base_kinds(rng: np.random.Generator) -> list[UnitKind]:
    """A stack of drawers, two doors, and one or two of any kind, in any order."""
    more: tuple[UnitKind, ...] = ("door", "double", "drawers")
    kinds: list[UnitKind] = ["drawers", "door", "door"]
    kinds += [more[int(rng.integers(3))] for _ in range(int(rng.integers(1, 3)))]
    rng.shuffle(kinds)
    return kinds


def _width(kind: UnitKind, rng: np.random.Generator) -> float:
    low, high = {"door": (0.30, 0.61), "double": (0.68, 1.0), "drawers": (0.38, 0.90)}[kind]
    return float(rng.uniform(low, high))


def _plan_row(kinds: list[UnitKind], measures: Measures, style: Style, look: Look, rng: np.random.Generator) -> list[Unit]:
    units, x = [], 0.0
    for kind in kinds:
        width = _width(kind, rng)
        place = Place(x=x, width_m=width, bottom=measures.bottom, top=measures.top, depth_m=measures.depth)
        units.append(plan_unit(kind, place, style, look, rng))
        x += width
    return units


def _plan_upper_row(right: float, measures: Measures, style: Style, look: Look, rng: np.random.Generator) -> list[Unit]:
    """Two to four wall cabinets, somewhere over the run."""
    kinds: list[UnitKind] = ["double" if rng.random() < 0.25 else "door" for _ in range(int(rng.integers(2, 5)))]
    widths = [_width(kind, rng) for kind in kinds]
    while sum(widths) > right - 0.05:
        kinds, widths = kinds[:-1], widths[:-1]
    units, x = [], float(rng.uniform(0.0, right - sum(widths)))
    for kind, width in zip(kinds, widths, strict=True):
        place = Place(
            x=x,
            width_m=width,
            bottom=measures.upper_bottom,
            top=measures.upper_top,
            depth_m=measures.upper_depth,
            upper=True,
        )
        units.append(plan_unit(kind, place, style, look, rng))
        x += width
    return units


def _shown_ends(units: list[Unit]) -> tuple[Furniture, ...]:
    """The row's furniture; of doors at its ends the outer side is seen."""
    furniture = [list(unit.furniture) for unit in units]
    if len(furniture[0]) == 1:
        furniture[0][0] = replace(furniture[0][0], shows_left_side=True)
    if len(furniture[-1]) == 1:
        furniture[-1][0] = replace(furniture[-1][0], shows_right_side=True)
    return tuple(each for unit in furniture for each in unit)
