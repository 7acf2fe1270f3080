"""Where the scan shows a worktop over a run of base units: its height, its front edge, its ends and its rear.

Nobody clicks a worktop. What says that there is one is level surface just above the units; without it none is made.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.scene import Source
from r2c2r_core.synthesize.dimensions import MeasuredObject, distance_to_wall
from r2c2r_core.synthesize.slabs import (
    BAND_M,
    CLEAR_M,
    Colour,
    Facets,
    Interval,
    Run,
    Slab,
    corners_of,
    cut,
    extent,
    flush,
    grouped,
    is_front,
    median_colour,
    meet,
    most_common,
    overlap,
)

_TOPS_M = (0.60, 1.15)  # heights at which base units end: sitting kitchens to bars
_STACKED_M = 0.05
_ABOVE_M = (-0.01, 0.11)  # of the units' tops: a worktop of 20-60 mm, on a rail or on tops that were measured low
_LEVEL = 0.8  # of a unit normal, upwards: within 37 deg, as fused scans of dark and polished stone are uneven
_BIN_M = 0.02
_EVIDENCE = 0.04  # of the units' plan: sensors lose most of a dark worktop, and things hide it …
_WIDE_M, _WIDE_SHARE, _SPECK = 0.10, 0.5, 0.01  # … but what is left lies along half of the run, not in one heap
_SHOWN = 0.5  # of what is seen over the units: from here on a strip is worktop too
_REACH_M = 0.70  # past the last unit: a corner, or an appliance that nobody clicked
_OVERHANG_M, _FINE_M = 0.06, 0.005
_EDGE_M, _HIDDEN = 0.03, 0.25
_THINNEST_M = 0.005
_BEHIND_M = 0.20  # a wall this near behind the units is where the worktop ends
_STOOD_IN_M = 0.02  # what ends this little below the surface stands on it


def runs_of(objects: Sequence[MeasuredObject]) -> list[Run]:
    """Base units on which a worktop can lie, grouped by the way they face, their plane and their top; the longest first."""
    units = [item for item in objects if is_front(item) and _TOPS_M[0] < extent(item, np.eye(3), 2)[1] < _TOPS_M[1]]
    return grouped([unit for unit in units if not any(_lies_on(other, unit) for other in units)], side=1)


def worktop(capture: Capture, facets: Facets, run: Run, objects: Sequence[MeasuredObject], taken: Sequence[Slab]) -> list[Slab]:
    """The worktop over a run, in as many pieces as what stands in it leaves; empty where the scan shows none."""
    front, back, top = run.least(1), run.most(1), run.most(2)
    level = facets.where((facets.normals[:, 2] > _LEVEL) & _within(facets.middles[:, 2], top, *_ABOVE_M))
    local = level.middles @ run.rotation
    over = _within(local[:, 1], 0.0, front - _OVERHANG_M, back + _BEHIND_M)
    level, local = level.where(over), local[over]
    units = [run.interval(unit, 0) for unit in run.units]
    above = _over_any(local[:, 0], units) & (local[:, 1] > front) & (local[:, 1] < back)
    length, depth = sum(high - low for low, high in units), back - front
    height = most_common(local[above, 2], level.areas[above], least=_EVIDENCE * length * depth)
    if height is None or height < top + CLEAR_M + _THINNEST_M:
        return []
    at_height = np.abs(local[:, 2] - height) < BAND_M
    level, local, above = level.where(at_height), local[at_height], above[at_height]
    if not _all_along(units, local[above, 0], level.areas[above] / depth):
        return []
    shown = _SHOWN * float(level.areas[above].sum()) / (length * depth)
    rear, rear_source = _rear(capture, run, local, level.areas, shown)
    overhang = _overhang(front - local[:, 1], level.areas, shown * length)
    under_it = (local[:, 1] > front) & (local[:, 1] < back)
    stretches = _stretches(units, local[under_it, 0], level.areas[under_it] / depth, shown)
    colour = _colour(facets, run, height, level.where(above))
    low_y, measured = front - overhang, overhang > 0 and rear_source == "measured"
    found = []
    for low, high in stretches:
        slab = Slab(
            run.rotation,
            np.array([low, low_y, top + CLEAR_M]),
            np.array([high, rear, height]),
            ("inferred", "measured" if measured else "inferred", "measured"),
            colour,
            flush_m=front if overhang > 0 else None,
        )
        slab = _below_what_stands_on_it(slab, objects)
        blocks = [corners_of(item, run.rotation) for item in objects if not any(item is unit for unit in run.units)]
        clicked = [corners_of(item, run.rotation) for item in objects if item.spec.name == "counter"]
        found += [
            piece
            for piece in cut(slab, [*blocks, *(other.corners(run.rotation) for other in taken)], clicked)
            if piece.high[2] - piece.low[2] >= _THINNEST_M and any(overlap((piece.low[0], piece.high[0]), u) > 0 for u in units)
        ]
    return found


def _lies_on(upper: MeasuredObject, lower: MeasuredObject) -> bool:
    """Whether one unit is the next of the other's stack."""
    if upper is lower or not flush(upper, lower):
        return False
    rotation = lower.world_from_object.rotation
    gap = extent(upper, rotation, 2)[0] - extent(lower, rotation, 2)[1]
    side = extent(lower, rotation, 0)
    return abs(gap) < _STACKED_M and overlap(side, extent(upper, rotation, 0)) > 0.5 * (side[1] - side[0])


def _over_any(along: np.ndarray, units: Sequence[Interval]) -> np.ndarray:
    return np.any([(low <= along) & (along <= high) for low, high in units], axis=0)


def _all_along(units: Sequence[Interval], along: np.ndarray, lengths: np.ndarray) -> bool:
    """Whether level surface is seen in most stretches of the units."""
    edges = np.arange(min(u[0] for u in units), max(u[1] for u in units) + _WIDE_M, _WIDE_M)
    seen = np.histogram(along, edges, weights=lengths)[0] > _SPECK * _WIDE_M
    return bool(seen[_over_any((edges[:-1] + edges[1:]) / 2, units)].mean() >= _WIDE_SHARE)


def _overhang(before_m: np.ndarray, areas: np.ndarray, length_m: float) -> float:
    """How far the surface goes on before the front plane, strip by strip; 0 where it is not seen to."""
    reached = 0.0
    for start in np.arange(0.0, _OVERHANG_M, _FINE_M):
        strip = (before_m >= start) & (before_m < start + _FINE_M)
        if areas[strip].sum() < _FINE_M * length_m:
            break
        reached = float(start + _FINE_M)
    return reached


def _rear(capture: Capture, run: Run, local: Points, areas: np.ndarray, shown: float) -> tuple[float, Source]:
    """The wall close behind the units, else where the surface ends, but never before their backs."""
    front, back = run.least(1), run.most(1)
    low, high = np.array([run.least(0), front, run.least(2)]), np.array([run.most(0), back, run.most(2)])
    to_wall = distance_to_wall(capture, run.rotation, low, high)
    if to_wall is not None and front + to_wall < back + _BEHIND_M:
        return max(front + to_wall, back), "measured"
    length, reached = run.most(0) - run.least(0), back
    for start in np.arange(back, back + _BEHIND_M, _BIN_M):
        strip = (local[:, 1] >= start) & (local[:, 1] < start + _BIN_M)
        if areas[strip].sum() < shown * _BIN_M * length:
            break
        reached = float(start + _BIN_M)
    return reached, "measured" if reached > back else "inferred"


def _colour(facets: Facets, run: Run, height: float, on_top: Facets) -> Colour:
    """The median of its surface, or of its front edge where much more of that is seen: papers and reflections hide tops."""
    local, turned = facets.middles @ run.rotation, facets.normals @ run.rotation
    length, low, high = run.most(0) - run.least(0), max(run.most(2), height - _EDGE_M), height - _FINE_M
    edge = (
        (turned[:, 1] < -_LEVEL) & _within(local[:, 2], 0.0, low, high) & _within(local[:, 0], 0.0, run.least(0), run.most(0))
    )
    edge &= _within(local[:, 1], run.least(1), -_OVERHANG_M, _OVERHANG_M / 2)
    edge_share = facets.areas[edge].sum() / (max(high - low, _FINE_M) * length)
    top_share = on_top.areas.sum() / (length * (run.most(1) - run.least(1)))
    return median_colour(facets.colours[edge] if top_share < _HIDDEN * edge_share else on_top.colours)


def _stretches(units: Sequence[Interval], along: np.ndarray, lengths: np.ndarray, least: float) -> Iterator[Interval]:
    """Where the worktop lies along the run: over the units, between them and past them where the surface goes on.

    `along` are positions of level surface and `lengths` its area by the units' depth; from the share `least` on it goes on.
    """
    start, end = min(u[0] for u in units) - _REACH_M, max(u[1] for u in units) + _REACH_M
    edges = np.arange(start, end + _BIN_M, _BIN_M)
    shown = np.histogram(along, edges, weights=lengths)[0] > least * _BIN_M
    strips = [(float(a), float(b)) for a, b, s in zip(edges[:-1], edges[1:], shown, strict=True) if s]
    joined: list[Interval] = []
    for low, high in sorted([*units, *strips]):
        if joined and low <= joined[-1][1] + 2 * _BIN_M:
            joined[-1] = (joined[-1][0], max(joined[-1][1], high))
        else:
            joined.append((low, high))
    for low, high in joined:
        if inside := [u for u in units if overlap(u, (low, high)) > 0]:
            first, last = min(u[0] for u in inside), max(u[1] for u in inside)
            yield low if first - low > 2 * _BIN_M else first, high if high - last > 2 * _BIN_M else last


def _below_what_stands_on_it(slab: Slab, objects: Sequence[MeasuredObject]) -> Slab:
    """The slab, lowered by millimetres where an object was placed that far into its surface."""
    height = float(slab.high[2])
    for item in objects:
        corners = corners_of(item, slab.rotation)
        bottom = float(corners[:, 2].min())
        if all(meet(slab, corners, axis) for axis in (0, 1)) and height - _STOOD_IN_M < bottom < height + CLEAR_M / 4:
            height = bottom - CLEAR_M / 4
    return replace(slab, high=np.array([*slab.high[:2], min(height, float(slab.high[2]))]))


def _within(values: np.ndarray, origin: float, low: float, high: float) -> np.ndarray:
    return np.asarray((values > origin + low) & (values < origin + high))
