"""Where the scan shows a worktop over a run of base units: its height, its front edge, its ends and its rear.

Nobody clicks a worktop. What says that there is one is level surface just above the units; without it none is made.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.scene import Source
from r2c2r_core.synthesize.dimensions import MeasuredObject, distance_to_wall
from r2c2r_core.synthesize.facets import BAND_M, Colour, Facets, most_common
from r2c2r_core.synthesize.slabs import CLEAR_M, Slab
from r2c2r_core.synthesize.unit_runs import Interval, UnitRun, flush, grouped, heights, is_front, overlap

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


def runs_of(objects: Sequence[MeasuredObject]) -> list[UnitRun]:
    """Base units on which a worktop can lie, grouped by the way they face, their plane and their top; the longest first."""
    units = [item for item in objects if is_front(item) and _TOPS_M[0] < heights(item)[1] < _TOPS_M[1]]
    return grouped([unit for unit in units if not any(_lies_on(other, unit) for other in units)], side=1)


def worktop(
    capture: Capture, facets: Facets, run: UnitRun, objects: Sequence[MeasuredObject], taken: Sequence[Slab]
) -> list[Slab]:
    """The worktop over a run, in as many pieces as what stands in it leaves; empty where the scan shows none.

    `facets` are of the world, `taken` the worktops of other runs.
    """
    top = _top_of(facets.turned(run.rotation), run)
    if top is None:
        return []
    rear, rear_source = _rear(capture, top)
    overhang = _overhang(top)
    depth: Source = "measured" if overhang > 0 and rear_source == "measured" else "inferred"
    clicked = [run.corners(item) for item in objects if item.spec.name == "counter"]
    obstacles = [run.corners(item) for item in objects if not any(item is unit for unit in run.units)]
    obstacles += [other.corners(run.rotation) for other in taken]
    pieces: list[Slab] = []
    for low, high in _stretches(top):
        slab = Slab(
            run.rotation,
            np.array([low, run.least(1) - overhang, run.most(2) + CLEAR_M]),
            np.array([high, rear, top.height_m]),
            ("inferred", depth, "measured"),
            top.colour,
            flush_m=run.least(1) if overhang > 0 else None,
        )
        pieces += _below_what_stands_on_it(slab, run, objects).cut(obstacles, clicked)
    return [
        piece
        for piece in pieces
        if piece.thickness_m >= _THINNEST_M and any(overlap(piece.along, unit) > 0 for unit in run.stretches)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class _Top:
    """Level surface that the scan shows at one height about a run; in the run's frame."""

    run: UnitRun
    height_m: float
    level: Facets  # over the units, before and behind them
    over: Facets  # of it, right over the units
    colour: Colour

    @property
    def shown(self) -> float:
        """The share of the units' plan from which on a strip is worktop too."""
        return _SHOWN * self.over.area_m2 / (_length(self.run) * _depth(self.run))


def _top_of(facets: Facets, run: UnitRun) -> _Top | None:
    """The level surface just above the units; None where there is too little, or it lies in one heap."""
    front, back, top = run.least(1), run.most(1), run.most(2)
    level = facets.where(facets.normals[:, 2] > _LEVEL)
    level = level.where(level.within(2, top + _ABOVE_M[0], top + _ABOVE_M[1]))
    level = level.where(level.within(1, front - _OVERHANG_M, back + _BEHIND_M))
    over = level.where(_over_any(level.middles[:, 0], run) & level.within(1, front, back))
    height = most_common(over.middles[:, 2], over.areas, least=_EVIDENCE * _length(run) * _depth(run))
    if height is None or height < top + CLEAR_M + _THINNEST_M:
        return None
    level, over = (part.where(np.abs(part.middles[:, 2] - height) < BAND_M) for part in (level, over))
    return _Top(run, height, level, over, _colour(facets, run, height, over)) if _all_along(run, over) else None


def _lies_on(upper: MeasuredObject, lower: MeasuredObject) -> bool:
    """Whether one unit is the next of the other's stack."""
    if upper is lower or not flush(upper, lower):
        return False
    alone = UnitRun(lower.world_from_object.rotation, (lower,))
    gap = alone.interval(upper, 2)[0] - alone.interval(lower, 2)[1]
    side = alone.interval(lower, 0)
    return abs(gap) < _STACKED_M and overlap(side, alone.interval(upper, 0)) > 0.5 * (side[1] - side[0])


def _length(run: UnitRun) -> float:
    return sum(high - low for low, high in run.stretches)


def _depth(run: UnitRun) -> float:
    return run.most(1) - run.least(1)


def _over_any(along: np.ndarray, run: UnitRun) -> np.ndarray:
    return np.any([(low <= along) & (along <= high) for low, high in run.stretches], axis=0)


def _all_along(run: UnitRun, over: Facets) -> bool:
    """Whether level surface is seen in most stretches of the units."""
    edges = np.arange(run.least(0), run.most(0) + _WIDE_M, _WIDE_M)
    seen = np.histogram(over.middles[:, 0], edges, weights=over.areas / _depth(run))[0] > _SPECK * _WIDE_M
    return bool(seen[_over_any((edges[:-1] + edges[1:]) / 2, run)].mean() >= _WIDE_SHARE)


def _overhang(top: _Top) -> float:
    """How far the surface goes on before the front plane, strip by strip; 0 where it is not seen to."""
    before_m, least = top.run.least(1) - top.level.middles[:, 1], top.shown * _length(top.run)
    reached = 0.0
    for start in np.arange(0.0, _OVERHANG_M, _FINE_M):
        strip = (before_m >= start) & (before_m < start + _FINE_M)
        if top.level.areas[strip].sum() < _FINE_M * least:
            break
        reached = float(start + _FINE_M)
    return reached


def _rear(capture: Capture, top: _Top) -> tuple[float, Source]:
    """The wall close behind the units, else where the surface ends, but never before their backs."""
    run, behind = top.run, top.level.middles[:, 1]
    front, back = run.least(1), run.most(1)
    low, high = np.array([run.least(0), front, run.least(2)]), np.array([run.most(0), back, run.most(2)])
    to_wall = distance_to_wall(capture, run.rotation, low, high, category_of("counter").depth)
    if to_wall is not None and front + to_wall < back + _BEHIND_M:
        return max(front + to_wall, back), "measured"
    least, reached = top.shown * (run.most(0) - run.least(0)), back
    for start in np.arange(back, back + _BEHIND_M, _BIN_M):
        strip = (behind >= start) & (behind < start + _BIN_M)
        if top.level.areas[strip].sum() < _BIN_M * least:
            break
        reached = float(start + _BIN_M)
    return reached, "measured" if reached > back else "inferred"


def _colour(facets: Facets, run: UnitRun, height: float, over: Facets) -> Colour:
    """That of the surface, or of its front edge where much more of that is seen: papers and reflections hide tops."""
    front, low, high = run.least(1), max(run.most(2), height - _EDGE_M), height - _FINE_M
    edge = facets.where(facets.normals[:, 1] < -_LEVEL)
    edge = edge.where(edge.within(2, low, high) & edge.within(0, run.least(0), run.most(0)))
    edge = edge.where(edge.within(1, front - _OVERHANG_M, front + _OVERHANG_M / 2))
    edge_share = edge.area_m2 / (max(high - low, _FINE_M) * (run.most(0) - run.least(0)))
    top_share = over.area_m2 / ((run.most(0) - run.least(0)) * _depth(run))
    return edge.colour if top_share < _HIDDEN * edge_share else over.colour


def _stretches(top: _Top) -> Iterator[Interval]:
    """Where the worktop lies along the run: over the units, between them and past them where the surface goes on."""
    run, units = top.run, top.run.stretches
    under = top.level.where(top.level.within(1, run.least(1), run.most(1)))
    edges = np.arange(run.least(0) - _REACH_M, run.most(0) + _REACH_M + _BIN_M, _BIN_M)
    shown = np.histogram(under.middles[:, 0], edges, weights=under.areas / _depth(run))[0] > top.shown * _BIN_M
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


def _below_what_stands_on_it(slab: Slab, run: UnitRun, objects: Sequence[MeasuredObject]) -> Slab:
    """The slab, lowered by millimetres where objects were placed that far into its surface."""
    height = float(slab.high[2])
    over = [corners for corners in map(run.corners, objects) if slab.meets(corners, 0) and slab.meets(corners, 1)]
    bottoms = [float(corners[:, 2].min()) - CLEAR_M / 4 for corners in over]
    lowest = min((bottom for bottom in bottoms if height - _STOOD_IN_M < bottom < height), default=height)
    return replace(slab, high=np.array([*slab.high[:2], lowest]))
