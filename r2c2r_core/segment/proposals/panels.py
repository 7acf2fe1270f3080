"""Panels of a run that pass as fronts: lines on four sides, flat, of a usual size, with a handle."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.kitchen.walls import distances_behind
from r2c2r_core.model.capture import Room
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.segment.certainty import front_certainty
from r2c2r_core.segment.fronts.front import Front, find_front, front_panel
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.proposals.naming import FrontLook, name_front
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.tuning import param, tuned

_NO_POINTS = np.zeros((0, 3))


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of panels as fronts."""

    shallowest_m: float = param(
        0.15, "m", "Minimum distance from a wall: nearer is the wall, something flat on it, or the back of a sink"
    )
    dark_lightness: float = param(60.0, "grey", "Maximum lightness of a dark cell")
    smallest_m: float = param(0.09, "m", "Minimum side of a front")
    small_m2: float = param(0.15, "m²", "Maximum area of a small panel")
    alone_worth: float = param(
        0.4,
        "ratio",
        "Factor of a lone small panel's confidence",
        source="drawers come in stacks: a lone one is part of a chair, or a book",
    )
    corner_m: float = param(0.06, "m", "Tolerance of where a carcass side starts at a front's end")
    deepest_m: float = param(0.8, "m", "Maximum depth of a carcass")
    row_m: float = param(0.03, "m", "Maximum misalignment of the fronts of a row")
    mate_worth: float = param(0.5, "share", "Fraction of a panel's doubt that a certain front aligned with it removes")
    surest: float = param(0.99, "score", "Maximum confidence, 0 to 1")
    least_mate: float = param(0.1, "score", "Minimum confidence, 0 to 1, of an aligned panel for it to count")
    equal_doors_m: float = param(
        0.012,
        "m",
        "Maximum difference in width of the doors of one cabinet",
        source="they are cut alike; two cabinets beside each other seldom are",
    )
    without_handle: float = param(0.6, "share", "Fraction of its confidence that a panel without a handle keeps")
    unseen: float = param(0.3, "share", "Fraction of a panel with depth at which flatness contributes no confidence")
    seen: float = param(0.8, "share", "Fraction of a panel with depth at which flatness contributes full confidence")
    on_wall: float = param(0.3, "share", "Fraction of its confidence that a panel on a wall keeps")
    mates_m: float = param(0.02, "m", "Maximum difference in height, and maximum gap, of the doors of a pair")
    at_seam: float = param(
        0.3, "share", "Maximum distance of a handle beside the seam from it, as a fraction of the door's width", ge=0, le=0.5
    )
    upright: float = param(1.8, "ratio", "Minimum ratio of height to width of an upright handle")
    widest_cabinet_m: float = param(0.95, "m", "Maximum width of two doors that are one cabinet")


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A panel that may be a front, with the evidence for it."""

    front: Front
    category: str
    confidence: float
    usual: float = 1.0  # 0..1: how usual its size is at its place; part of the confidence
    plain: str | None = None  # for a machine identified by its handle alone: its category among fronts with the same handle

    @property
    def run(self) -> Run:
        """The run that contains the panel."""
        return self.front.run

    @property
    def rectangle(self) -> Rectangle3:
        """Its rectangle with level edges."""
        return self.front.rectangle


def find_panels(run: Run, room: Room) -> list[Panel]:
    """Panels of the run that could be fronts, with the doors of a pair joined."""
    params = tuned(Params)
    found: list[Panel] = []
    mates: list[Cell] = []
    for cell in sorted(run.cells, key=lambda cell: (cell.left, cell.top)):
        if cell in mates or min(cell.width, cell.height) * run.grid.cell_m < params.smallest_m:
            continue
        panel = _judge(find_front(run, _middle(run, cell), _NO_POINTS, pair=False), room)
        mate = _mate(run, cell)
        if panel is not None and mate is not None and _is_door(category_of(panel.category)):
            panel = _judge(find_front(run, _middle(run, cell), _NO_POINTS, pair=True), room, pair=True)
            mates.append(mate)
        if panel is not None:
            found.append(panel)
    return [_beside(panel, [other for other in found if other is not panel]) for panel in found]


def _is_door(category: Category) -> bool:
    return category.kind == "front" and category.opens == "side"


def without_sides(panels: list[Panel]) -> list[Panel]:
    """Panels without those on carcass sides: of two faces that meet at an outer corner, the better front stays."""
    strength: dict[int, float] = {}
    for panel in panels:
        strength[id(panel.run)] = strength.get(id(panel.run), 0.0) + panel.confidence * _area(panel)
    return [
        panel
        for panel in panels
        if not any(strength[id(panel.run)] < strength[id(other.run)] and _is_side_of(panel, other) for other in panels)
    ]


def _judge(front: Front | None, room: Room, *, pair: bool = False) -> Panel | None:
    """Front with its category and evidence; None when it is too small for one."""
    if front is None:
        return None
    run, cell, cell_m = front.run, front.cell, front.run.grid.cell_m
    area = (slice(max(round(cell.top), 0), round(cell.bottom)), slice(max(round(cell.left), 0), round(cell.right)))
    if min(cell.width, cell.height) * cell_m < tuned(Params).smallest_m or not run.seen[area].size:
        return None
    bottom = float(run.grid.points_at(np.array([[cell.left, cell.bottom]]))[0, 2]) if room.floor_found else None
    look = FrontLook(
        width_m=cell.width * cell_m,
        height_m=cell.height * cell_m,
        bottom_m=bottom,
        handle=front.handle,
        dark=_dark_share(run, area),
        pair=pair,
    )
    category, usual = name_front(look)
    by_handle = category_of(category).one_front and not category_of(category).dark
    plain = name_front(look, machines=False)[0] if by_handle else None
    return Panel(front, category, usual * _evidence(front, category_of(category), area, room), usual, plain)


def _beside(panel: Panel, others: list[Panel]) -> Panel:
    """Panel with confidence updated by its run: fronts stand in rows and stacks, small flat objects stand alone."""
    params = tuned(Params)
    slack = params.row_m / panel.run.grid.cell_m
    mates = [
        other
        for other in others
        if other.confidence > params.least_mate and _aligned(panel.front.cell, other.front.cell, slack)
    ]
    category = panel.category if panel.plain is None or _odd_one_out(mates) else panel.plain
    if mates:
        best = max(other.confidence for other in mates)
        unsure = (1 - panel.confidence / max(panel.usual, 1e-6)) * (1 - params.mate_worth * best)
        return replace(panel, category=category, confidence=min(panel.usual * (1 - unsure), params.surest))
    alone = params.alone_worth if _area(panel) < params.small_m2 else 1.0
    return replace(panel, category=category, confidence=alone * panel.confidence)


def _aligned(a: Cell, b: Cell, slack: float) -> bool:
    """Whether two panels are in one row, or above each other."""
    in_row = abs(a.top - b.top) < slack and abs(a.bottom - b.bottom) < slack
    return in_row or (abs(a.left - b.left) < slack and abs(a.right - b.right) < slack)


def _odd_one_out(mates: list[Panel]) -> bool:
    """Whether the doors beside a horizontal handle have upright ones: a machine among cupboards."""
    handles = [mate.front.handle for mate in mates if category_of(mate.category).opens in ("side", "bottom")]
    upright = tuned(Params).upright
    return bool(handles) and all(handle is not None and handle.height > upright * handle.width for handle in handles)


def _evidence(front: Front, category: Category, area: tuple[slice, slice], room: Room) -> float:
    """Confidence (0..1) from the certainty of its edges, handle, flatness by depth, and distance from walls."""
    params = tuned(Params)
    handle = front.handle.confidence if front.handle is not None else 0.0
    handled = params.without_handle + (1 - params.without_handle) * handle
    flat = np.clip((front.run.seen[area].mean() - params.unseen) / (params.seen - params.unseen), 0, 1)
    free = params.on_wall if is_on_wall(front.run, room, params.shallowest_m) else 1.0
    return float(front_certainty(front_panel(front), category) * handled * flat * free)


def is_on_wall(run: Run, room: Room, shallowest_m: float) -> bool:
    """Whether a run is a wall, or too near one that faces the same way to have a carcass behind it."""
    middle = run.region.world_from_plane.translation
    return any(abs(distance) < shallowest_m for distance in distances_behind(room.walls, middle, run.grid.outward))


def _middle(run: Run, cell: Cell) -> Points:
    return run.grid.rectangle(cell).centre[None]


def _mate(run: Run, cell: Cell) -> Cell | None:
    """Right door of a pair with this left door: equally high, exactly as wide, both handles beside the seam."""
    params = tuned(Params)
    slack = params.mates_m / run.grid.cell_m
    for other in run.cells:
        beside = abs(other.left - cell.right) < slack
        if not beside or abs(other.top - cell.top) > slack or abs(other.bottom - cell.bottom) > slack:
            continue
        left, right = (find_front(run, _middle(run, door), _NO_POINTS, pair=False) for door in (cell, other))
        if left is None or right is None or left.handle is None or right.handle is None:
            continue
        equal = abs(left.cell.width - right.cell.width) * run.grid.cell_m < params.equal_doors_m
        one_cabinet = (left.cell.width + right.cell.width) * run.grid.cell_m < params.widest_cabinet_m
        if equal and one_cabinet and _handle_at(left) > 1 - params.at_seam and _handle_at(right) < params.at_seam:
            return other
    return None


def _handle_at(front: Front) -> float:
    """Position of the handle across a front, 0 at the left edge and 1 at the right."""
    assert front.handle is not None
    return ((front.handle.left + front.handle.right) / 2 - front.cell.left) / front.cell.width


def _dark_share(run: Run, area: tuple[slice, slice]) -> float:
    colours = run.mosaic[area]
    known = colours.any(axis=2)
    return float((colours[known].mean(axis=1) < tuned(Params).dark_lightness).mean()) if known.any() else 0.0


def _area(panel: Panel) -> float:
    return panel.rectangle.width_m * panel.rectangle.height_m


def _is_side_of(side: Panel, front: Panel) -> bool:
    """Whether a panel lies on the face that starts at a front's left or right edge and extends backwards."""
    params = tuned(Params)
    normal = front.run.grid.outward
    if abs(float(normal @ side.run.grid.outward)) > 0.3:
        return False
    half_w, half_h = front.rectangle.half_m
    x, behind, z = front.rectangle.world_from_front.inverse.apply(side.front.outline.corners).T
    outward = float(front.run.region.world_from_plane.rotation[:, 0] @ side.run.grid.outward)
    at_edge = abs(abs(float(x.mean())) - half_w) < params.corner_m and float(x.mean()) * outward > 0
    # The side may end short of the front: a door is in front of its carcass, or the cut removed a piece of it.
    is_behind = behind.min() > -params.corner_m and behind.min() < 0.35 and behind.max() < params.deepest_m
    overlap = min(float(z.max()), half_h) - max(float(z.min()), -half_h)
    return at_edge and bool(is_behind) and overlap > 0.5 * min(2 * half_h, float(np.ptp(z)))
