"""One unit of a run: its fronts, the box behind them and the fixed parts between them, in the run's frame."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from r2c2r_core.synthetic.kitchen import Board, Carcass, Furniture, Handle, HandleKind, Hinge, Leaf, Paint, Style
from r2c2r_core.synthetic.looks import Look

UnitKind = Literal["door", "double", "drawers"]

_RUNNERS_M = (0.27, 0.30, 0.35, 0.40, 0.45, 0.50, 0.55)  # nominal lengths that makers of runners list
_HINGES_DEG = (95.0, 100.0, 107.0, 110.0)  # openings that makers of concealed hinges list
_FACE_FRAME_M = 0.02
_CHANNEL_DEPTH_M = 0.028


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where a unit stands: what its carcass takes up."""

    x: float
    width_m: float
    bottom: float
    top: float
    depth_m: float  # from the outer face of the fronts to the wall
    upper: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """What one unit brings to its run; names are given when all units are known."""

    furniture: tuple[Furniture, ...]
    carcass: Carcass
    boards: tuple[Board, ...]


def plan_unit(kind: UnitKind, place: Place, style: Style, look: Look, rng: np.random.Generator) -> Unit:
    """A unit of that kind, made as the kitchen's look says."""
    rows = _rows(place, look, style.gap_m, _shares(kind, rng))
    left, right = _sides(place, look, style.gap_m)
    if kind == "drawers":
        leaves = [_drawer(left, right, row, place, look, rng) for row in rows]
        furniture = tuple(_unit("drawer", place, (leaf,)) for leaf in leaves)
    elif kind == "double":
        middle, half_gap = (left + right) / 2, style.gap_m / 2
        pair = (
            _door(left, middle - half_gap, rows[0], "left", place, look, rng),
            _door(middle + half_gap, right, rows[0], "right", place, look, rng),
        )
        furniture = (_unit("double_door_wall_cabinet" if place.upper else "double_door_cabinet", place, pair),)
    else:
        hinge: Hinge = "left" if rng.random() < 0.5 else "right"
        door = _door(left, right, rows[0], hinge, place, look, rng)
        furniture = (_unit("wall_cabinet" if place.upper else "cabinet", place, (door,)),)
    return Unit(furniture=furniture, carcass=_carcass(place, look, style), boards=_boards(place, look, style, rows))


def _shares(kind: UnitKind, rng: np.random.Generator) -> tuple[float, ...]:
    """Of the height, from top to bottom: a stack has a low drawer over others, or equal ones."""
    if kind != "drawers":
        return (1.0,)
    count = int(rng.integers(2, 5))
    if count > 2 and rng.random() < 0.7:
        first = float(rng.uniform(0.17, 0.25))
        return (first, *([(1 - first) / (count - 1)] * (count - 1)))
    return (1 / count,) * count


def _rows(place: Place, look: Look, gap: float, shares: tuple[float, ...]) -> list[tuple[float, float]]:
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


def _sides(place: Place, look: Look, gap: float) -> tuple[float, float]:
    edge = gap / 2 if look.face_frame is None else look.face_frame.stile_m + gap
    return place.x + edge, place.x + place.width_m - edge


def _carcass(place: Place, look: Look, style: Style) -> Carcass:
    set_back = style.front_thickness_m if look.channel_m is None or place.upper else _CHANNEL_DEPTH_M
    return Carcass(
        x=place.x,
        z=place.bottom,
        width_m=place.width_m,
        height_m=place.top - place.bottom,
        depth_m=place.depth_m - set_back,
        glazed=place.upper and look.filling == "glass",
    )


def _boards(place: Place, look: Look, style: Style, rows: list[tuple[float, float]]) -> tuple[Board, ...]:
    """The face frame round the openings, or the profiles at the bottom of the channels."""
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


def _unit(category: str, place: Place, leaves: tuple[Leaf, ...]) -> Furniture:
    return Furniture(name="", category=category, leaves=leaves, depth_m=place.depth_m)


def _drawer(left: float, right: float, row: tuple[float, float], place: Place, look: Look, rng: np.random.Generator) -> Leaf:
    """As far out as its runner: full extension, or three quarters of it."""
    low, high = row
    width, height = right - left, high - low
    runners = [length for length in _RUNNERS_M if length < place.depth_m - 0.06]
    travel = runners[-1 - int(rng.integers(2))] * (1.0 if rng.random() < 0.65 else 0.74)
    handle = None
    if look.drawer_handle is not None:
        length = min(_length(look.drawer_handle, look), 0.7 * width)
        share = 0.5 if height < 0.2 else float(rng.choice((0.5, 0.72)))
        handle = _handle(look.drawer_handle, length, vertical=False, x=width / 2, z=share * height)
    frame = look.frame(height, upper=False)
    return Leaf(
        x=left,
        z=low,
        width_m=width,
        height_m=height,
        hinge=None,
        handle=handle,
        open_limit=round(travel, 3),
        frame=frame,
    )


def _door(
    left: float,
    right: float,
    row: tuple[float, float],
    hinge: Hinge,
    place: Place,
    look: Look,
    rng: np.random.Generator,
) -> Leaf:
    low, high = row
    width, height = right - left, high - low
    angle = float(rng.choice(_HINGES_DEG)) + float(rng.uniform(-2, 2))
    return Leaf(
        x=left,
        z=low,
        width_m=width,
        height_m=height,
        hinge=hinge,
        handle=_door_handle(width, height, hinge, place, look, rng),
        open_limit=round(float(np.radians(angle)), 3),
        frame=look.frame(height, upper=place.upper),
    )


def _door_handle(
    width: float, height: float, hinge: Hinge, place: Place, look: Look, rng: np.random.Generator
) -> Handle | None:
    """Upright on the opening side near the edge that hands reach; lying in that edge's middle where the look says so."""
    if look.door_handle is None:
        return None
    if look.level_handles:
        length = min(_length(look.door_handle, look), 0.6 * width)
        away = float(rng.uniform(0.03, 0.06))
        return _handle(look.door_handle, length, vertical=False, x=width / 2, z=away if place.upper else height - away)
    length = min(_length(look.door_handle, look), 0.45 * height)
    rail = look.rail_m
    inset = rail / 2 if rail is not None else float(rng.uniform(0.028, 0.07))
    from_end = length / 2 + float(rng.uniform(0.03, 0.09))
    x = inset if hinge == "right" else width - inset
    return _handle(look.door_handle, length, vertical=True, x=x, z=from_end if place.upper else height - from_end)


def _length(kind: HandleKind, look: Look) -> float:
    return {"knob": 0.032, "cup": 0.095}.get(kind, look.handle_length_m)


def _handle(kind: HandleKind, length: float, *, vertical: bool, x: float, z: float) -> Handle:
    thickness = {"bar": 0.012, "flat": 0.014, "bow": 0.011, "knob": 0.032, "cup": 0.042}[kind]
    reach = {"bar": 0.034, "flat": 0.028, "bow": 0.032, "knob": 0.030, "cup": 0.026}[kind]
    return Handle(kind=kind, length_m=length, thickness_m=thickness, reach_m=reach, vertical=vertical, x=x, z=z)


def named(units: list[Unit], counts: dict[str, int]) -> list[Unit]:
    """The units with names that count on from `counts`, which is kept up to date."""
    done = []
    for unit in units:
        furniture = []
        for each in unit.furniture:
            counts[each.category] = counts.get(each.category, 0) + 1
            furniture.append(replace(each, name=f"{each.category}_{counts[each.category]}"))
        done.append(replace(unit, furniture=tuple(furniture)))
    return done
