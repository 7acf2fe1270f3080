"""Detection of a worktop over a run of base units: its height, front edge, ends and rear.

The evidence is level surface just above the units; without it none is made but where somebody clicked one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.motion import Source
from r2c2r_core.synthesize.dimensions import MeasuredObject, depth_behind
from r2c2r_core.synthesize.facets import Colour, Facets, most_common
from r2c2r_core.synthesize.facets import Params as FacetsParams
from r2c2r_core.synthesize.runs import weighted_median
from r2c2r_core.synthesize.slabs import Params as SlabsParams
from r2c2r_core.synthesize.slabs import Slab
from r2c2r_core.synthesize.unit_runs import Interval, UnitRun, flush, grouped, heights, is_front, overlap
from r2c2r_core.tuning import param, tuned

_GREY = (0.6, 0.6, 0.6)  # of a worktop that the scan shows no part of; its mesh has its own colours


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of worktop detection."""

    tops_m: tuple[float, float] = param(
        (0.60, 1.15), "m", "Minimum and maximum height of the tops of base units", source="sitting kitchens to bars"
    )
    stacked_m: float = param(0.05, "m", "Maximum gap between units that stand on each other")
    above_m: tuple[float, float] = param(
        (-0.01, 0.11),
        "m",
        "Minimum and maximum height of a worktop over the units' tops",
        source="a worktop of 20-60 mm, on a rail or on tops that were measured low",
    )
    level: float = param(
        0.8,
        "cosine",
        "Minimum vertical component of a normal: within 37 degrees of up",
        source="fused scans of dark and polished stone are uneven",
    )
    bin_m: float = param(0.02, "m", "Width of the strips that are tested", gt=0)
    evidence: float = param(
        0.04,
        "share",
        "Minimum fraction of the units' plan that must be observed as level surface",
        source="sensors lose most of a dark worktop, and objects occlude it",
    )
    wide_m: float = param(0.10, "m", "Length of the stretches into which the run is divided", gt=0)
    wide_share: float = param(
        0.5, "share", "Minimum fraction of the stretches that must show surface, so that it is not concentrated in one place"
    )
    speck: float = param(0.01, "share", "Fraction of a stretch below which surface is ignored")
    shown: float = param(0.5, "share", "Observed density relative to that over the units above which a strip is worktop too")
    reach_m: float = param(0.70, "m", "Maximum extension past the last unit: a corner, or an appliance that was not clicked")
    corner_m: float = param(
        0.12, "m", "Maximum gap between two runs that meet at a corner", source="fillers of 2-10 cm, see kitchen/categories.py"
    )
    overhang_m: float = param(0.06, "m", "Maximum overhang in front of the fronts")
    fine_m: float = param(0.005, "m", "Step of the search for the front edge", gt=0)
    edge_m: float = param(0.03, "m", "Depth below the surface down to which the front edge is searched")
    hidden: float = param(0.25, "ratio", "Ratio of observed top to observed edge below which the edge determines the colour")
    thinnest_m: float = param(0.005, "m", "Minimum thickness of a worktop")
    behind_m: float = param(0.20, "m", "Maximum distance of a wall behind the units at which the worktop ends")
    stood_in_m: float = param(0.02, "m", "Maximum depth below the surface at which an object's underside still stands on it")


def runs_of(objects: Sequence[MeasuredObject]) -> list[UnitRun]:
    """Base units that can carry a worktop, grouped by direction, plane and top; the longest run first."""
    params = tuned(Params)
    units = [item for item in objects if is_front(item) and params.tops_m[0] < heights(item)[1] < params.tops_m[1]]
    return grouped([unit for unit in units if not any(_lies_on(other, unit) for other in units)], side=1)


def worktop(
    capture: Capture,
    facets: Facets,
    run: UnitRun,
    objects: Sequence[MeasuredObject],
    taken: Sequence[Slab],
    others: Sequence[UnitRun] = (),
) -> list[Slab]:
    """The worktop over a run, in pieces between the objects that stand in it; empty where the scan shows none.

    `facets` are in the world, `taken` are the worktops of `others`, runs that it meets at corners.
    """
    params = tuned(Params)
    slabs_params = tuned(SlabsParams)
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
    for low, high in (_into_corners(stretch, run, others) for stretch in _stretches(top)):
        slab = Slab(
            run.rotation,
            np.array([low, run.least(1) - overhang, run.most(2) + slabs_params.clear_m]),
            np.array([high, rear, top.height_m]),
            ("inferred", depth, "measured"),
            top.colour,
            flush_m=run.least(1) if overhang > 0 else None,
        )
        pieces += _below_what_stands_on_it(slab, run, objects).cut(obstacles, clicked)
    return [
        piece
        for piece in pieces
        if piece.thickness_m >= params.thinnest_m and any(overlap(piece.along, unit) > 0 for unit in run.stretches)
    ]


def clicked_worktop(
    facets: Facets, item: MeasuredObject, objects: Sequence[MeasuredObject], taken: Sequence[Slab]
) -> list[Slab]:
    """A worktop as clicked, on the units under it, in pieces between the objects and worktops that stand in it."""
    clear_m, run = tuned(SlabsParams).clear_m, UnitRun(item.world_from_object.rotation, (item,))
    low, high = (np.array([end(axis) for axis in range(3)]) for end in (run.least, run.most))
    units = [run.corners(unit) for unit in objects if is_front(unit)]
    level = facets.turned(run.rotation)
    level = level.where(
        (level.normals[:, 2] > tuned(Params).level) & ((level.middles > low) & (level.middles < high)).all(axis=1)
    )
    slab = Slab(run.rotation, low, high, item.sources, level.colour if len(level.areas) else _GREY)
    tops = [float(unit[:, 2].max()) + clear_m for unit in units if slab.meets(unit, 0) and slab.meets(unit, 1)]
    slab = replace(slab, low=np.array([*low[:2], max([low[2], *(top for top in tops if top < high[2])])]))
    pieces = _below_what_stands_on_it(slab, run, objects).cut(
        [*(run.corners(other) for other in objects), *(other.corners(run.rotation) for other in taken)]
    )
    return [piece for piece in pieces if piece.thickness_m >= tuned(Params).thinnest_m]


@dataclass(frozen=True, slots=True, eq=False)
class _Top:
    """Level surface at one height about a run; in the run's frame."""

    run: UnitRun
    height_m: float
    level: Facets  # over the units, in front of and behind them
    over: Facets  # the part directly over the units
    colour: Colour

    @property
    def shown(self) -> float:
        """Fraction of the units' plan above which a strip is worktop too."""
        return tuned(Params).shown * self.over.area_m2 / (_length(self.run) * _depth(self.run))


def _top_of(facets: Facets, run: UnitRun) -> _Top | None:
    """The level surface just above the units; None if there is too little, or it is concentrated in one place."""
    params = tuned(Params)
    facets_params = tuned(FacetsParams)
    front, back, top = run.least(1), run.most(1), run.most(2)
    level = facets.where(facets.normals[:, 2] > params.level)
    level = level.where(level.within(2, top + params.above_m[0], top + params.above_m[1]))
    level = level.where(level.within(1, front - params.overhang_m, back + params.behind_m))
    over = level.where(_over_any(level.middles[:, 0], run) & level.within(1, front, back))
    widths = np.array([unit.dimensions_m[0] for unit in run.units])
    edge_m = weighted_median(np.array([unit.strip_over_m for unit in run.units]), widths)
    height = most_common(over.middles[:, 2], over.areas, least=params.evidence * _length(run) * _depth(run))
    # black stone has no depth: where the pictures show its front edge over most of the run, that tells its height
    height = height if edge_m == 0.0 else top + tuned(SlabsParams).clear_m + edge_m
    if height is None or height < top + tuned(SlabsParams).clear_m + params.thinnest_m:
        return None
    level, over = (part.where(np.abs(part.middles[:, 2] - height) < facets_params.band_m) for part in (level, over))
    if edge_m > 0.0 and len(over.areas):
        return _Top(run, height, level, over, over.colour)
    return _Top(run, height, level, over, _colour(facets, run, height, over)) if _all_along(run, over) else None


def _lies_on(upper: MeasuredObject, lower: MeasuredObject) -> bool:
    """Whether one unit stands on the other in a stack."""
    if upper is lower or not flush(upper, lower):
        return False
    alone = UnitRun(lower.world_from_object.rotation, (lower,))
    gap = alone.interval(upper, 2)[0] - alone.interval(lower, 2)[1]
    side = alone.interval(lower, 0)
    return abs(gap) < tuned(Params).stacked_m and overlap(side, alone.interval(upper, 0)) > 0.5 * (side[1] - side[0])


def _length(run: UnitRun) -> float:
    return sum(high - low for low, high in run.stretches)


def _depth(run: UnitRun) -> float:
    return run.most(1) - run.least(1)


def _over_any(along: np.ndarray, run: UnitRun) -> np.ndarray:
    return np.any([(low <= along) & (along <= high) for low, high in run.stretches], axis=0)


def _all_along(run: UnitRun, over: Facets) -> bool:
    """Whether level surface is observed in most stretches of the units."""
    params = tuned(Params)
    edges = np.arange(run.least(0), run.most(0) + params.wide_m, params.wide_m)
    seen = np.histogram(over.middles[:, 0], edges, weights=over.areas / _depth(run))[0] > params.speck * params.wide_m
    return bool(seen[_over_any((edges[:-1] + edges[1:]) / 2, run)].mean() >= params.wide_share)


def _overhang(top: _Top) -> float:
    """Overhang of the surface in front of the front plane, strip by strip; 0 if none is observed."""
    params = tuned(Params)
    before_m, least = top.run.least(1) - top.level.middles[:, 1], top.shown * _length(top.run)
    reached = 0.0
    for start in np.arange(0.0, params.overhang_m, params.fine_m):
        strip = (before_m >= start) & (before_m < start + params.fine_m)
        if top.level.areas[strip].sum() < params.fine_m * least:
            break
        reached = float(start + params.fine_m)
    return reached


def _rear(capture: Capture, top: _Top) -> tuple[float, Source]:
    """The wall close behind the units, else the end of the surface, but never in front of their backs."""
    params = tuned(Params)
    run, behind = top.run, top.level.middles[:, 1]
    front, back = run.least(1), run.most(1)
    low, high = np.array([run.least(0), front, run.least(2)]), np.array([run.most(0), back, run.most(2)])
    to_wall = depth_behind(capture, run.rotation, low, high, category_of("counter").depth).wall_m
    if to_wall is not None and front + to_wall < back + params.behind_m:
        return max(front + to_wall, back), "measured"
    least, reached = top.shown * (run.most(0) - run.least(0)), back
    for start in np.arange(back, back + params.behind_m, params.bin_m):
        strip = (behind >= start) & (behind < start + params.bin_m)
        if top.level.areas[strip].sum() < params.bin_m * least:
            break
        reached = float(start + params.bin_m)
    return reached, "measured" if reached > back else "inferred"


def _colour(facets: Facets, run: UnitRun, height: float, over: Facets) -> Colour:
    """Colour of the surface, or of its front edge where much more of that is visible: papers and reflections hide tops."""
    params = tuned(Params)
    front, low, high = run.least(1), max(run.most(2), height - params.edge_m), height - params.fine_m
    edge = facets.where(facets.normals[:, 1] < -params.level)
    edge = edge.where(edge.within(2, low, high) & edge.within(0, run.least(0), run.most(0)))
    edge = edge.where(edge.within(1, front - params.overhang_m, front + params.overhang_m / 2))
    edge_share = edge.area_m2 / (max(high - low, params.fine_m) * (run.most(0) - run.least(0)))
    top_share = over.area_m2 / ((run.most(0) - run.least(0)) * _depth(run))
    return edge.colour if top_share < params.hidden * edge_share else over.colour


def _stretches(top: _Top) -> Iterator[Interval]:
    """Intervals of the worktop along the run: over the units, between them and past them where the surface continues."""
    params = tuned(Params)
    run, units = top.run, top.run.stretches
    under = top.level.where(top.level.within(1, run.least(1), run.most(1)))
    edges = np.arange(run.least(0) - params.reach_m, run.most(0) + params.reach_m + params.bin_m, params.bin_m)
    shown = np.histogram(under.middles[:, 0], edges, weights=under.areas / _depth(run))[0] > top.shown * params.bin_m
    strips = [(float(a), float(b)) for a, b, s in zip(edges[:-1], edges[1:], shown, strict=True) if s]
    joined: list[Interval] = []
    for low, high in sorted([*units, *strips]):
        if joined and low <= joined[-1][1] + 2 * params.bin_m:
            joined[-1] = (joined[-1][0], max(joined[-1][1], high))
        else:
            joined.append((low, high))
    for low, high in joined:
        if inside := [u for u in units if overlap(u, (low, high)) > 0]:
            first, last = min(u[0] for u in inside), max(u[1] for u in inside)
            yield low if first - low > 2 * params.bin_m else first, high if high - last > 2 * params.bin_m else last


def _into_corners(stretch: Interval, run: UnitRun, others: Sequence[UnitRun]) -> Interval:
    """The interval with the blind corners at its ends: to the back of a run across it that begins there, before its fronts."""
    params, (low, high) = tuned(Params), stretch
    for other in others:
        (left, near, _), (right, _, top) = (
            end([end(run.corners(unit), axis=0) for unit in other.units], axis=0) for end in (np.min, np.max)
        )
        if near < run.least(1) - params.corner_m and abs(top - run.most(2)) < params.stacked_m:
            high = right if abs(left - high) < params.corner_m else high
            low = left if abs(right - low) < params.corner_m else low
    return low, high


def _below_what_stands_on_it(slab: Slab, run: UnitRun, objects: Sequence[MeasuredObject]) -> Slab:
    """The slab, lowered by millimetres where objects were placed that far into its surface."""
    params = tuned(Params)
    slabs_params = tuned(SlabsParams)
    height = float(slab.high[2])
    over = [corners for corners in map(run.corners, objects) if slab.meets(corners, 0) and slab.meets(corners, 1)]
    bottoms = [float(corners[:, 2].min()) - slabs_params.clear_m / 4 for corners in over]
    lowest = min((bottom for bottom in bottoms if height - params.stood_in_m < bottom < height), default=height)
    return replace(slab, high=np.array([*slab.high[:2], lowest]))
