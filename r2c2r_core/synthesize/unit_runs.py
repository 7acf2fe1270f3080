"""Runs of base units side by side, which share a worktop above and a plinth below."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Matrix3, Points
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.runs import built_in
from r2c2r_core.tuning import param, tuned

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned tolerances of units under one worktop."""

    flush_m: float = param(0.06, "m", "Maximum depth difference between their fronts")
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
