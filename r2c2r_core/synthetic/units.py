"""One unit of a run: its fronts, the box behind them and the fixed parts between them, in the run's frame."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from r2c2r_core.synthetic.kitchen import Board, Carcass, Furniture, Hinge, Leaf, Paint, Style
from r2c2r_core.synthetic.leaves import Place, door_leaf, drawer_leaf
from r2c2r_core.synthetic.looks import Look

UnitKind = Literal["door", "double", "drawers"]

_FACE_FRAME_M = 0.02
_CHANNEL_DEPTH_M = 0.028


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """Parts of one unit in its run; names are assigned when all units are known."""

    furniture: tuple[Furniture, ...]
    carcass: Carcass
    boards: tuple[Board, ...]


def plan_unit(kind: UnitKind, place: Place, style: Style, look: Look, rng: np.random.Generator) -> Unit:
    """A unit of that kind in the kitchen's look."""
    rows = rows_of(place, look, style.gap_m, shares_of(kind, rng))
    left, right = sides_of(place, look, style.gap_m)
    if kind == "drawers":
        leaves = [drawer_leaf(left, right, row, place, look, rng) for row in rows]
        furniture = tuple(furniture_of("drawer", place, (leaf,)) for leaf in leaves)
    elif kind == "double":
        middle, half_gap = (left + right) / 2, style.gap_m / 2
        pair = (
            door_leaf(left, middle - half_gap, rows[0], "left", place, look, rng),
            door_leaf(middle + half_gap, right, rows[0], "right", place, look, rng),
        )
        furniture = (furniture_of("double_door_wall_cabinet" if place.upper else "double_door_cabinet", place, pair),)
    else:
        hinge: Hinge = "left" if rng.random() < 0.5 else "right"
        door = door_leaf(left, right, rows[0], hinge, place, look, rng)
        furniture = (furniture_of("wall_cabinet" if place.upper else "cabinet", place, (door,)),)
    return Unit(furniture=furniture, carcass=carcass_of(place, look, style), boards=boards_of(place, look, style, rows))


def shares_of(kind: UnitKind, rng: np.random.Generator) -> tuple[float, ...]:
    """Fractions of the height, from top to bottom: a stack has a low drawer over others, or equal ones."""
    if kind != "drawers":
        return (1.0,)
    count = int(rng.integers(2, 5))
    if count > 2 and rng.random() < 0.7:
        first = float(rng.uniform(0.17, 0.25))
        return (first, *([(1 - first) / (count - 1)] * (count - 1)))
    return (1 / count,) * count


def rows_of(place: Place, look: Look, gap: float, shares: tuple[float, ...]) -> list[tuple[float, float]]:
    """Bottom and top of each front from top to bottom."""
    low, high, between = place.bottom, place.top, [gap] * (len(shares) - 1)
    if look.face_frame is not None:
        edge = look.face_frame.rail_m + gap
        low, high, between = low + edge, high - edge, [look.face_frame.between_m + 2 * gap] * len(between)
    elif look.channel_m is not None and not place.upper:
        high -= look.channel_m
        between = [look.channel_m if look.every_channel or i == len(between) - 1 else gap for i in range(len(between))]
    elif place.upper:
        low -= look.grip_m
    usable = high - low - sum(between)
    rows, top = [], high
    for share, spare in zip(shares, [*between, 0.0], strict=True):
        rows.append((top - usable * share, top))
        top -= usable * share + spare
    return rows


def sides_of(place: Place, look: Look, gap: float) -> tuple[float, float]:
    edge = gap / 2 if look.face_frame is None else look.face_frame.stile_m + gap
    return place.x + edge, place.x + place.width_m - edge


def carcass_of(place: Place, look: Look, style: Style) -> Carcass:
    set_back = style.front_thickness_m if look.channel_m is None or place.upper else _CHANNEL_DEPTH_M
    return Carcass(
        x=place.x,
        z=place.bottom,
        width_m=place.width_m,
        height_m=place.top - place.bottom,
        depth_m=place.depth_m - set_back,
        glazed=place.upper and look.filling == "glass",
    )


def boards_of(place: Place, look: Look, style: Style, rows: list[tuple[float, float]]) -> tuple[Board, ...]:
    """The face frame around the openings, or the profiles at the bottom of the channels."""
    face, left, right = -place.depth_m, place.x, place.x + place.width_m
    if look.face_frame is not None:
        stile, paint = look.face_frame.stile_m, style.wall_front if place.upper else style.base_front
        inner_left, inner_right, gap = left + stile, right - stile, style.gap_m
        levels = [place.top, *(z for low, high in rows for z in (high + gap, low - gap)), place.bottom]
        spans = [(left, inner_left, place.bottom, place.top), (inner_right, right, place.bottom, place.top)]
        spans += [(inner_left, inner_right, low, high) for high, low in zip(levels[::2], levels[1::2], strict=True)]
        return tuple(_board(span, face, face + _FACE_FRAME_M, paint) for span in spans)
    if look.channel_m is None or place.upper:
        return ()
    back = face + _CHANNEL_DEPTH_M
    levels = [place.top, *(z for low, high in rows[:-1] for z in (high, low)), rows[-1][1]]
    return tuple(
        _board((left, right, low, high), back - 0.001, back, style.handle)
        for high, low in zip(levels[::2], levels[1::2], strict=True)
        if high - low > 2 * style.gap_m
    )


def _board(span: tuple[float, float, float, float], front_y: float, back_y: float, paint: Paint) -> Board:
    x0, x1, z0, z1 = span
    return Board(low=(x0, front_y, z0), high=(x1, back_y, z1), paint=paint)


def furniture_of(category: str, place: Place, leaves: tuple[Leaf, ...]) -> Furniture:
    return Furniture(name="", category=category, leaves=leaves, depth_m=place.depth_m)
