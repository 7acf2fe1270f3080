"""Interiors behind fronts that open: boards, shelves, and the drawer that slides out with its front.

All lengths of one interior have a single source, so that the rendering and the truth agree.
"""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.model.motion import Inside
from r2c2r_core.synthetic.kitchen import Appliance, Carcass, Furniture, Kitchen, Paint, Run
from r2c2r_core.synthetic.patches import Patch, Vector, box, inner_walls, moving, quad
from r2c2r_core.synthetic.props import crockery

_BOARDS_M, _MACHINE_WALL_M, _FRIDGE_WALL_M = (0.015, 0.019), 0.03, 0.045
_RUNNER_M, _DRAWER_BOARDS_M, _DRAWER_BOTTOM_M = 0.0125, (0.011, 0.016), 0.008
_LEAST_SHELF_SPACE_M = 0.2
_TUB = Paint(kind="steel", colour=(0.42, 0.43, 0.44), gloss=0.3, texel_m=0.003)
_OVEN = Paint(kind="laminate", colour=(0.10, 0.10, 0.11), gloss=0.3, texel_m=0.003)
_WHITE = Paint(kind="laminate", colour=(0.78, 0.79, 0.80), gloss=0.2, texel_m=0.003)
_MACHINES = {"dishwasher": _TUB, "oven": _OVEN, "microwave": _OVEN}


@dataclass(frozen=True, slots=True, kw_only=True)
class Tray:
    """The box behind a drawer's front: its outer bounds when closed, in the frame of its run."""

    low: Vector
    high: Vector
    board_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Hollow:
    """A compartment: the clear space between its boards, in the frame of its run; open at its front."""

    low: Vector
    high: Vector
    board_m: float  # of the sides
    back_m: float  # y of the closed front's back, from which depth is measured
    front_m: float  # thickness of the front
    shelves_m: tuple[float, ...]  # upper faces above the bottom
    tray: Tray | None
    paint: Paint
    filled: bool  # with cups on its boards

    @property
    def inside(self) -> Inside:
        """True dimensions: of the drawer if there is one, else of the compartment."""
        if self.tray is not None:
            (x0, _, z0), (x1, y1, z1), wall = self.tray.low, self.tray.high, self.tray.board_m
            return Inside(
                depth_m=y1 - wall - self.back_m,
                width_m=x1 - x0 - 2 * wall,
                height_m=z1 - z0 - _DRAWER_BOTTOM_M,
                board_m=wall,
                front_m=self.front_m,
            )
        return Inside(
            depth_m=self.high[1] - self.back_m,
            width_m=self.high[0] - self.low[0],
            height_m=self.high[2] - self.low[2],
            shelves_m=self.shelves_m,
            board_m=self.board_m,
            front_m=self.front_m,
        )


def unit_hollow(kitchen: Kitchen, run: Run, furniture: Furniture, rng: np.random.Generator) -> Hollow:
    """Compartment behind the front of a unit."""
    carcass, first, last = carcass_behind(run, furniture), furniture.leaves[0], furniture.leaves[-1]
    machine = _MACHINES.get(furniture.category)
    board = _MACHINE_WALL_M if machine is not None else float(rng.uniform(*_BOARDS_M))
    left, right = (carcass.x, carcass.x + carcass.width_m) if first.slides else (first.x, last.x + last.width_m)
    front, back = -carcass.depth_m, -furniture.depth_m + kitchen.style.front_thickness_m
    low = (max(left, carcass.x) + board, front, max(first.z, carcass.z) + board)
    top = min(first.z + first.height_m, carcass.z + carcass.height_m) - board
    rear = -float(rng.uniform(0.006, 0.03)) if machine is None else -float(rng.uniform(0.06, 0.12))
    high = (min(right, carcass.x + carcass.width_m) - board, rear, top)
    is_drawer = first.hinge is None and first.slides is None
    return Hollow(
        low=low,
        high=high,
        board_m=board,
        back_m=back,
        front_m=kitchen.style.front_thickness_m,
        shelves_m=() if is_drawer else _shelves(high[2] - low[2], rng),
        tray=_tray(low, high, back, first.open_limit, rng) if is_drawer else None,
        paint=kitchen.style.carcass if machine is None else machine,
        filled=machine is None and not is_drawer,
    )


def appliance_hollow(thing: Appliance, front: str, rng: np.random.Generator) -> Hollow:
    """Compartment behind a front of a free-standing machine, in its box's frame: x from its middle, y and z from its centre."""
    (width, depth, height), is_drawer = thing.size_m, front.endswith("_drawer")
    cold = thing.category != "microwave"
    wall = _FRIDGE_WALL_M if cold else 0.012
    left, right = -width / 2, width / 2
    if not cold:
        left, right = (left, left + thing.door_width_m) if thing.hinge == "left" else (right - thing.door_width_m, right)
    bottom = -height / 2 + (thing.drawer_m if thing.drawer_m and not is_drawer else 0.0) + 0.018
    top = -height / 2 + thing.drawer_m if is_drawer else height / 2
    back = -depth / 2 + thing.door_thickness_m
    front_y = back + (0.012 if cold else 0.002)
    low, high = (left + wall, front_y, bottom + wall), (right - wall, depth / 2 - wall, top - wall)
    shelves = _shelves(high[2] - low[2], rng) if cold and not is_drawer else ()
    return Hollow(
        low=low,
        high=high,
        board_m=wall,
        back_m=back,
        front_m=thing.door_thickness_m,
        shelves_m=shelves,
        tray=_tray(low, high, back, 0.6 * depth, rng) if is_drawer else None,
        paint=_WHITE if cold else _OVEN,
        filled=cold and not is_drawer,
    )


def carcass_behind(run: Run, furniture: Furniture) -> Carcass:
    """The carcass that a unit's front closes."""
    leaf = furniture.leaves[0]
    x, z = leaf.x + leaf.width_m / 2, leaf.z + leaf.height_m / 2
    carcasses = (*run.base_carcasses, *run.upper_carcasses)
    return next(c for c in carcasses if c.x < x < c.x + c.width_m and c.z < z < c.z + c.height_m)


def hollow_patches(hollow: Hollow, object_id: int = 0) -> list[Patch]:
    """The boards of a compartment as seen from within, its shelves, and the objects on them."""
    low, high, board = hollow.low, hollow.high, hollow.board_m
    patches = inner_walls(low, high, hollow.paint, object_id)
    for level in hollow.shelves_m:
        z = low[2] + level
        face = (low[0], low[1] + 0.012, z - board), (high[0], high[1], z)
        patches += box(*face, hollow.paint, faces="front top bottom", object_id=object_id)
    if hollow.filled:
        levels = [level for level in (0.0, *hollow.shelves_m) if _head_room(level, hollow) > 0.13]
        for level in levels:
            patches += crockery(low[0], high[0], (low[1] + 2 * high[1]) / 3, low[2] + level)
    return [replace(patch, is_inner=True) for patch in patches]


def tray_patches(hollow: Hollow, mover: str, object_id: int) -> list[Patch]:
    """The closed drawer of a compartment, with a box in it; empty without a drawer."""
    if hollow.tray is None:
        return []
    low, high, wall = hollow.tray.low, hollow.tray.high, hollow.tray.board_m
    inner_low = (low[0] + wall, low[1], low[2] + _DRAWER_BOTTOM_M)
    inner_high = (high[0] - wall, high[1] - wall, high[2])
    patches = box(low, high, hollow.paint, faces="left right bottom back", object_id=object_id)
    patches += inner_walls(inner_low, inner_high, hollow.paint, object_id)
    for rim_low, rim_high in (
        ((low[0], low[1]), (inner_low[0], high[1])),
        ((inner_high[0], low[1]), (high[0], high[1])),
        ((inner_low[0], inner_high[1]), (inner_high[0], high[1])),
    ):
        rim = (*rim_low, high[2] - 0.001), (*rim_high, high[2])
        patches += box(*rim, hollow.paint, faces="top", object_id=object_id)
    return moving(patches + _contents(inner_low, inner_high), mover, is_body=True)


def pierced_front(carcass: Carcass, hollows: list[Hollow], paint: Paint) -> list[Patch]:
    """Front plane of a carcass, facing -Y, outside its compartments: the edges of its boards."""
    x0, x1 = carcass.x, carcass.x + carcass.width_m
    y, z, top = -carcass.depth_m, carcass.z, carcass.z + carcass.height_m
    spans = []
    for hollow in sorted(hollows, key=lambda each: each.low[2]):
        spans += [(x0, x1, z, hollow.low[2])]
        spans += [(x0, hollow.low[0], hollow.low[2], hollow.high[2]), (hollow.high[0], x1, hollow.low[2], hollow.high[2])]
        z = hollow.high[2]
    return facing_quads([*spans, (x0, x1, z, top)], y, paint)


def facing_quads(spans: list[tuple[float, float, float, float]], y: float, paint: Paint, object_id: int = 0) -> list[Patch]:
    """Rectangles (left, right, bottom, top) in one plane that faces -Y."""
    return [
        quad(np.array([a, y, d]), np.array([b - a, 0.0, 0.0]), np.array([0.0, 0.0, c - d]), paint, object_id=object_id)
        for a, b, c, d in spans
        if b - a > 1e-4 and d - c > 1e-4
    ]


def _shelves(height: float, rng: np.random.Generator) -> tuple[float, ...]:
    """Heights of shelves, as many as leave space for a hand, not quite evenly spaced."""
    count = min(int(height / _LEAST_SHELF_SPACE_M) - 1, int(rng.integers(1, 4)))
    if count < 1:
        return ()
    even = np.arange(1, count + 1) / (count + 1)
    return tuple(round(float(v), 4) for v in height * (even + rng.uniform(-0.06, 0.06, count)))


def _tray(low: Vector, high: Vector, back: float, travel: float, rng: np.random.Generator) -> Tray:
    """Drawer as deep as its travel, limited by the compartment; its sides lower than the opening."""
    wall, most = float(rng.uniform(*_DRAWER_BOARDS_M)), high[1] - 0.012
    rear = min(back + travel + float(rng.uniform(0.01, 0.09)), most)
    rise = float(rng.uniform(0.5, 0.85)) * (high[2] - low[2])
    return Tray(
        low=(low[0] + _RUNNER_M, back, low[2] + 0.006),
        high=(high[0] - _RUNNER_M, rear, low[2] + 0.006 + rise),
        board_m=wall,
    )


def _head_room(level: float, hollow: Hollow) -> float:
    above = [other for other in hollow.shelves_m if other > level]
    return (min(above) - hollow.board_m if above else hollow.high[2] - hollow.low[2]) - level


def _contents(low: Vector, high: Vector) -> list[Patch]:
    """A box that lies in a drawer."""
    width, depth, height = (high[k] - low[k] for k in range(3))
    paint = Paint(kind="label", colour=(0.55, 0.42, 0.25), accent=(0.12, 0.16, 0.35), texel_m=0.001, seed=11)
    corner = (low[0] + 0.12 * width, low[1] + 0.2 * depth, low[2])
    far = (low[0] + 0.5 * width, low[1] + 0.62 * depth, low[2] + min(0.55 * height, 0.09))
    return box(corner, far, paint, faces="front back left right top")
