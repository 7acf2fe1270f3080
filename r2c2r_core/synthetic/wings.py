"""Further runs of a layout, each in its own frame, and the corner where two meet."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from r2c2r_core.synthetic.kitchen import Board, Fixed, Furniture, Paint, Prop, Run, Style
from r2c2r_core.synthetic.leaves import Place
from r2c2r_core.synthetic.looks import Look
from r2c2r_core.synthetic.special import BUILT_IN_WIDTH_M, SpecialKind, blind_corner, plan_any
from r2c2r_core.synthetic.units import Unit, UnitKind, plan_unit

AnyKind = UnitKind | SpecialKind
_WIDTHS_M: dict[AnyKind, tuple[float, float]] = {
    "door": (0.30, 0.61),
    "double": (0.68, 1.0),
    "drawers": (0.38, 0.90),
    "sliding": (0.95, 1.3),
    "dishwasher": (0.596, 0.605),
    "tall": (BUILT_IN_WIDTH_M + 0.003, BUILT_IN_WIDTH_M + 0.006),
}
_PANEL_M = 0.018
_HOB = Paint(kind="hob", colour=(0.012, 0.012, 0.013), accent=(0.12, 0.12, 0.12), gloss=0.9)


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """Heights and depths common to all units of a kitchen, metres."""

    plinth: float
    bottom: float
    top: float  # of the carcasses
    worktop_top: float
    worktop_thickness: float
    depth: float
    upper_bottom: float
    upper_top: float
    upper_depth: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Kit:
    """Dimensions, paints and look common to every run of a kitchen."""

    measures: Measures
    style: Style
    look: Look


def plan_row(kinds: list[AnyKind], kit: Kit, rng: np.random.Generator, start: float = 0.0) -> list[Unit]:
    """Units side by side from x = `start` on."""
    units, x = [], start
    for kind in kinds:
        width = float(rng.uniform(*_WIDTHS_M[kind]))
        measures = kit.measures
        top = measures.upper_top if kind == "tall" else measures.top
        place = Place(x=x, width_m=width, bottom=measures.bottom, top=top, depth_m=measures.depth)
        units.append(plan_any(kind, place, kit.style, kit.look, rng))
        x += width
    return units


def plan_upper_row(low: float, high: float, kinds: list[UnitKind], kit: Kit, rng: np.random.Generator) -> list[Unit]:
    """Wall cabinets side by side, as many of them as fit, somewhere between two x."""
    widths = [float(rng.uniform(*_WIDTHS_M[kind])) for kind in kinds]
    while sum(widths) > high - low:
        kinds, widths = kinds[:-1], widths[:-1]
    units, x, measures = [], low + float(rng.uniform(0.0, high - low - sum(widths))), kit.measures
    for kind, width in zip(kinds, widths, strict=True):
        place = Place(
            x=x,
            width_m=width,
            bottom=measures.upper_bottom,
            top=measures.upper_top,
            depth_m=measures.upper_depth,
            upper=True,
        )
        units.append(plan_unit(kind, place, kit.style, kit.look, rng))
        x += width
    return units


def right_end(units: list[Unit]) -> float:
    """X of the right end of a row."""
    return units[-1].carcass.x + units[-1].carcass.width_m


def plan_corner(start: float, kit: Kit, rng: np.random.Generator) -> tuple[Unit, float]:
    """The blind unit in the corner at a row's right end, and the width of the filler beside its door."""
    filler, width = float(rng.uniform(0.03, 0.07)), float(rng.uniform(0.35, 0.50))
    measures = kit.measures
    place = Place(x=start, width_m=width, bottom=measures.bottom, top=measures.top, depth_m=measures.depth)
    door = plan_unit("door", place, kit.style, kit.look, rng)
    return blind_corner(door, measures.depth, filler, False, kit.style), filler


def corner_wing(corner_x: float, filler: float, kit: Kit, rng: np.random.Generator) -> Run:
    """Run along the right wall from the corner: a hob under a hood, a dishwasher, and a tall unit at the end."""
    depth, kinds = kit.measures.depth, _shuffled(["drawers", "dishwasher", "door"], rng)
    units = plan_row([*kinds, "tall"], kit, rng)
    worktop_end = units[-1].carcass.x
    hob_x = worktop_end / 2
    hood = _hood(hob_x, kit, rng)
    upper = plan_upper_row(0.02, hob_x - 0.36, ["door", "door"], kit, rng)
    paper = _paper_on(units[0].furniture[0], rng)
    run = standing(units, upper, (-(filler - 0.018), worktop_end))
    return replace(
        run,
        fixed=(hood,),
        boards=(*run.boards, _plinth(units[-1], kit), *paper),
        props=(Prop(kind="hob", x=hob_x, y=-depth / 2, width_m=0.58, paint=_HOB),),
        place=(corner_x, -(depth + filler)),
        yaw_rad=-np.pi / 2,
    )


def opposite_wing(right: float, kit: Kit, rng: np.random.Generator) -> Run:
    """Run across an aisle: sliding doors, drawers and doors, with wall cabinets and an open shelf over them."""
    measures = kit.measures
    units = plan_row(_shuffled(["sliding", "drawers", "door", "dishwasher"], rng), kit, rng)
    end = right_end(units)
    upper = plan_upper_row(0.7, end, ["door", "double", "door"], kit, rng)
    shelf = Fixed(
        name="",
        category="open_shelf",
        low=(0.02, -0.8 * measures.upper_depth, measures.upper_bottom),
        high=(0.02 + float(rng.uniform(0.45, 0.65)), 0.0, measures.upper_top),
    )
    aisle = float(rng.uniform(1.25, 1.6))
    run = standing(units, upper, (-_PANEL_M, end + _PANEL_M))
    return replace(
        run,
        fixed=(shelf,),
        boards=(*run.boards, *_end_panels(end, kit), *_towel_on(units[-1].furniture[0], rng)),
        place=(right, -(2 * measures.depth + aisle)),
        yaw_rad=np.pi,
    )


def island(right: float, kit: Kit, rng: np.random.Generator) -> tuple[Run, Run]:
    """Two rows back to back in front of the main run: the outer one faces the room, the inner one the main run."""
    outer = plan_row(_shuffled(["double", "drawers"], rng), kit, rng)
    length, depth = right_end(outer), kit.measures.depth
    inner = _stretched(["drawers", "door", "door"], length, kit, rng)
    aisle = float(rng.uniform(1.15, 1.4))
    middle_x, back_y = right / 2, -(2 * depth + aisle)
    panels = _end_panels(length, kit)
    ends = (-_PANEL_M, length + _PANEL_M)
    left_x = middle_x - length / 2
    hob = Prop(kind="hob", x=length / 2, y=-0.02, width_m=0.56, paint=_HOB)
    facing_room, facing_run = standing(outer, [], ends), standing(inner, [], ends)
    return (
        replace(facing_room, boards=(*facing_room.boards, *panels), place=(left_x, back_y), has_wall=False, props=(hob,)),
        replace(
            facing_run,
            boards=(*facing_run.boards, *panels),
            place=(left_x + length, back_y),
            yaw_rad=np.pi,
            has_wall=False,
        ),
    )


def _stretched(kinds: list[AnyKind], length: float, kit: Kit, rng: np.random.Generator) -> list[Unit]:
    """A row of those kinds with widths that fill a length."""
    shares = rng.uniform(0.8, 1.2, len(kinds))
    units, x, measures = [], 0.0, kit.measures
    for kind, width in zip(kinds, length * shares / shares.sum(), strict=True):
        place = Place(x=x, width_m=float(width), bottom=measures.bottom, top=measures.top, depth_m=measures.depth)
        units.append(plan_any(kind, place, kit.style, kit.look, rng))
        x += float(width)
    return units


def standing(units: list[Unit], upper: list[Unit], ends: tuple[float, float]) -> Run:
    """A run of those units along the kitchen's back wall."""
    return Run(
        base=_furniture_of(units),
        upper=_furniture_of(upper),
        base_carcasses=tuple(unit.carcass for unit in units),
        upper_carcasses=tuple(unit.carcass for unit in upper),
        ends=ends,
        boards=tuple(board for unit in (*units, *upper) for board in unit.boards),
    )


def _furniture_of(units: list[Unit]) -> tuple[Furniture, ...]:
    return tuple(each for unit in units for each in unit.furniture)


def _hood(x: float, kit: Kit, rng: np.random.Generator) -> Fixed:
    low = kit.measures.worktop_top + float(rng.uniform(0.60, 0.72))
    half, depth = 0.3, float(rng.uniform(0.42, 0.50))
    return Fixed(
        name="", category="hood", low=(x - half, -depth, low), high=(x + half, 0.0, low + float(rng.uniform(0.5, 0.7)))
    )


def _plinth(unit: Unit, kit: Kit) -> Board:
    carcass, front = unit.carcass, -kit.measures.depth + 0.06
    low, high = (carcass.x, front, 0.0), (carcass.x + carcass.width_m, front + 0.016, kit.measures.plinth)
    return Board(low=low, high=high, paint=kit.style.plinth)


def _end_panels(length: float, kit: Kit) -> tuple[Board, Board]:
    """A board at either end, from the floor to the worktop."""
    measures, under = kit.measures, kit.measures.worktop_top - kit.measures.worktop_thickness
    return tuple(  # type: ignore[return-value]
        Board(low=(x, -measures.depth, 0.0), high=(x + _PANEL_M, 0.0, under), paint=kit.style.base_front)
        for x in (-_PANEL_M, length)
    )


def _paper_on(furniture: Furniture, rng: np.random.Generator) -> tuple[Board, ...]:
    """A sheet held by two magnets on the lower half of a front."""
    leaf, face = furniture.leaves[0], -furniture.depth_m
    width, height = 0.148, min(0.21, 0.4 * leaf.height_m)
    x = leaf.x + float(rng.uniform(0.2, 0.8)) * (leaf.width_m - width)
    z = leaf.z + 0.08 * leaf.height_m
    sheet = Paint(kind="label", colour=(0.80, 0.80, 0.76), accent=(0.10, 0.15, 0.45), texel_m=0.0008, seed=7)
    magnet = Paint(kind="plain", colour=(0.55, 0.05, 0.05), texel_m=0.002)
    tops = [(x + share * width - 0.01, z + height - 0.02) for share in (0.2, 0.8)]
    return (
        Board(low=(x, face - 0.0012, z), high=(x + width, face - 0.0002, z + height), paint=sheet),
        *(Board(low=(a, face - 0.007, b), high=(a + 0.02, face - 0.0012, b + 0.02), paint=magnet) for a, b in tops),
    )


def _towel_on(furniture: Furniture, rng: np.random.Generator) -> tuple[Board, ...]:
    """A towel over a front's upper edge."""
    leaf, face = furniture.leaves[0], -furniture.depth_m
    width, height = min(0.26, 0.6 * leaf.width_m), min(0.42, 0.7 * leaf.height_m)
    x = leaf.x + float(rng.uniform(0.15, 0.85)) * (leaf.width_m - width)
    top = leaf.z + leaf.height_m - 0.004
    cloth = Paint(kind="stripes", colour=(0.75, 0.73, 0.68), accent=(0.45, 0.08, 0.08), texel_m=0.001)
    return (Board(low=(x, face - 0.012, top - height), high=(x + width, face - 0.0005, top), paint=cloth),)


def _shuffled(kinds: list[AnyKind], rng: np.random.Generator) -> list[AnyKind]:
    return [kinds[int(i)] for i in rng.permutation(len(kinds))]


def named(runs: tuple[Run, ...]) -> tuple[Run, ...]:
    """The runs with their objects numbered by category: base units first, then wall units, then fixed objects."""
    counts: dict[str, int] = {}
    runs = tuple(replace(run, base=_numbered(run.base, counts)) for run in runs)
    runs = tuple(replace(run, upper=_numbered(run.upper, counts)) for run in runs)
    return tuple(replace(run, fixed=_numbered(run.fixed, counts)) for run in runs)


_Named = TypeVar("_Named", Furniture, Fixed)


def _numbered(things: tuple[_Named, ...], counts: dict[str, int]) -> tuple[_Named, ...]:
    done = []
    for thing in things:
        counts[thing.category] = counts.get(thing.category, 0) + 1
        done.append(replace(thing, name=f"{thing.category}_{counts[thing.category]}"))
    return tuple(done)
