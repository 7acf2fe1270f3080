"""Runs of units side by side or stacked, which share one back, and of base units, a worktop above and a plinth below."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from r2c2r_core.arrays import Matrix3, Points
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.kitchen.depth import sigma_m
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.edits import trimmed
from r2c2r_core.synthesize.runs import built_in, weighted_median
from r2c2r_core.synthesize.solve import groups
from r2c2r_core.tuning import param, tuned

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned tolerances of units of one run."""

    flush_m: float = param(0.06, "m", "Maximum depth difference between their fronts")
    seam_m: float = param(0.03, "m", "Maximum gap between units side by side or stacked: more than an end panel")
    step_m: float = param(0.03, "m", "Maximum height difference between their tops")


@dataclass(frozen=True, slots=True, eq=False)
class UnitRun:
    """Base units in one plane with one top. Run frame: the units' axes (fronts at -y), the world's origin."""

    rotation: Matrix3  # world_from_run
    units: tuple[MeasuredObject, ...]

    def corners(self, item: MeasuredObject) -> Points:
        """An object's box (8, 3) in the run's frame."""
        return np.asarray(item.world_from_object.apply(box_corners(item.dimensions_m)) @ self.rotation)

    def interval(self, item: MeasuredObject, axis: int) -> Interval:
        """Interval of an object along an axis of the run."""
        along = self.corners(item)[:, axis]
        return float(along.min()), float(along.max())

    @property
    def stretches(self) -> list[Interval]:
        """Intervals of its units along the run, from left to right."""
        return sorted(self.interval(unit, 0) for unit in self.units)

    def least(self, axis: int) -> float:
        """Minimum of the units along an axis: their front for y, their undersides for z."""
        return min(self.interval(unit, axis)[0] for unit in self.units)

    def most(self, axis: int) -> float:
        """Maximum of the units along an axis: their backs for y, their tops for z."""
        return max(self.interval(unit, axis)[1] for unit in self.units)


def with_one_back(objects: Sequence[MeasuredObject]) -> list[MeasuredObject]:
    """The objects, units of one run reaching back to one plane: the median of theirs, weighted by precision.

    An oven is thereby as deep as its unit. A unit whose depth was observed or given by a person votes, and keeps it.
    """
    items = list(objects)
    units = [i for i, item in enumerate(items) if is_front(item)]
    for run in groups(len(items), [(i, j) for i, j in combinations(units, 2) if _adjoin(items[i], items[j])]):
        backs = np.array([items[i].dimensions_m[1] - items[i].front_centre @ items[run[0]].outward for i in run])
        back = weighted_median(backs, np.array([items[i].depth_sigma_m for i in run]) ** -2.0)
        for i, own in zip(run, backs, strict=True):
            items[i] = _deepened(items[i], float(back - own))
    return items


def _adjoin(a: MeasuredObject, b: MeasuredObject) -> bool:
    """Whether two fronts are side by side or stacked, approximately in one plane."""
    apart = np.abs(a.world_from_object.rotation.T @ (b.front_centre - a.front_centre))
    gaps = (apart - (a.dimensions_m + b.dimensions_m) / 2)[[0, 2]]
    return flush(a, b) and bool(gaps.max() < tuned(Params).seam_m and gaps.min() < 0.0)


def _deepened(item: MeasuredObject, by_m: float) -> MeasuredObject:
    """The unit with its back moved and its mesh in place; unchanged where its depth is known or would be implausible."""
    known = item.fixed_by_person or item.depth_sigma_m <= sigma_m("box")
    if known or not item.spec.depth.holds(float(item.dimensions_m[1]) + by_m):
        return item
    deeper = trimmed(item, 1, 1.0, -by_m)
    shift = deeper.world_from_object @ item.world_from_object.inverse
    return replace(deeper, placed_pose=shift @ item.placed_pose)


def is_front(item: MeasuredObject) -> bool:
    """Whether it is a built-in unit that opens."""
    return built_in(item) and item.spec.opens != "rigid"


def grouped(units: Sequence[MeasuredObject], side: int) -> list[UnitRun]:
    """Units in one front plane whose tops (side 1) or undersides (0) are on one line; the longest run first."""
    groups: list[list[MeasuredObject]] = []
    for unit in sorted(units, key=lambda item: -float(item.dimensions_m[0])):
        home = next((group for group in groups if _one_run(group[0], unit, side)), None)
        if home is None:
            groups.append([unit])
        else:
            home.append(unit)
    runs = [UnitRun(group[0].world_from_object.rotation, tuple(group)) for group in groups]
    return sorted(runs, key=lambda run: -sum(float(unit.dimensions_m[0]) for unit in run.units))


def heights(item: MeasuredObject) -> Interval:
    """Underside and top in the world."""
    z = item.world_from_object.apply(box_corners(item.dimensions_m))[:, 2]
    return float(z.min()), float(z.max())


def flush(a: MeasuredObject, b: MeasuredObject) -> bool:
    """Whether both fronts are approximately in one plane."""
    apart = float((a.front_centre - b.front_centre) @ a.outward)
    return float(a.outward @ b.outward) > 1 - 1e-3 and abs(apart) < tuned(Params).flush_m


def overlap(a: Interval, b: Interval) -> float:
    """Length of the overlap of two intervals; negative for disjoint ones."""
    return min(a[1], b[1]) - max(a[0], b[0])


def _one_run(a: MeasuredObject, b: MeasuredObject, side: int) -> bool:
    return flush(a, b) and abs(heights(a)[side] - heights(b)[side]) < tuned(Params).step_m
