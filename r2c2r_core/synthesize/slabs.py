"""Upright boxes that follow a run of base units, and what the scan shows near them: what worktops and plinths are made of."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Matrix3, Points, Vector3
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.meshes import face_areas, face_normals
from r2c2r_core.model.capture import SceneSurface
from r2c2r_core.model.scene import Source
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.runs import built_in

CLEAR_M = 0.002  # left to what stands beside, below and on it
BAND_M = 0.01  # surface this near to where most of it lies is one plane
_FLUSH_M, _STEP_M = 0.06, 0.03  # fronts this far apart in depth, and tops in height, are under one worktop
_SHORTEST_M = 0.10

Interval = tuple[float, float]
Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """Faces of the scan: middles and unit normals (n, 3), areas (n,), colours (n, 3) 0..1; in the world."""

    middles: Points
    normals: Points
    areas: np.ndarray
    colours: np.ndarray

    def where(self, chosen: np.ndarray) -> "Facets":
        """Those of a mask."""
        return Facets(self.middles[chosen], self.normals[chosen], self.areas[chosen], self.colours[chosen])


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Base units in one plane with one top. Run frame: axes as the units', origin as the world's."""

    rotation: Matrix3  # world_from_run
    units: tuple[MeasuredObject, ...]

    def interval(self, unit: MeasuredObject, axis: int) -> Interval:
        """Where a unit lies along an axis of the run."""
        return extent(unit, self.rotation, axis)

    def least(self, axis: int) -> float:
        """The furthest of the units towards an axis' negative side: their front for y, their undersides for z."""
        return min(self.interval(unit, axis)[0] for unit in self.units)

    def most(self, axis: int) -> float:
        """The furthest of the units towards an axis' positive side: their backs for y, their tops for z."""
        return max(self.interval(unit, axis)[1] for unit in self.units)


@dataclass(frozen=True, slots=True, eq=False)
class Slab:
    """An upright box in a run's frame, what measured its width, depth and height, and its colour."""

    rotation: Matrix3
    low: Vector3
    high: Vector3
    sources: tuple[Source, Source, Source]
    colour: Colour
    notes: tuple[str, ...] = ()
    flush_m: float | None = None  # y of the fronts, where it goes on before them

    @property
    def flush(self) -> "Slab":
        """The same without what hangs over the fronts."""
        low = self.low if self.flush_m is None else np.array([self.low[0], self.flush_m, self.low[2]])
        return replace(self, low=low, flush_m=None)

    def corners(self, rotation: Matrix3) -> Points:
        """Its corners (8, 3) in another run's frame."""
        return (box_corners(self.high - self.low) + (self.low + self.high) / 2) @ self.rotation.T @ rotation


def facets_of(surface: SceneSurface) -> Facets:
    """The scan as faces to be counted by area."""
    if len(surface.faces) == 0:
        return Facets(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)))
    vertices = np.asarray(surface.vertices_world, dtype=np.float64)
    return Facets(
        vertices[surface.faces].mean(axis=1),
        face_normals(vertices, surface.faces),
        face_areas(vertices, surface.faces),
        surface.colours[surface.faces].mean(axis=1) / 255.0,
    )


def grouped(units: Sequence[MeasuredObject], side: int) -> list[Run]:
    """Units in one front plane whose tops (side 1) or undersides (0) are on one line; the longest run first."""
    groups: list[list[MeasuredObject]] = []
    for unit in sorted(units, key=lambda item: -float(item.dimensions_m[0])):
        home = next((group for group in groups if _one_run(group[0], unit, side)), None)
        if home is None:
            groups.append([unit])
        else:
            home.append(unit)
    runs = [Run(group[0].world_from_object.rotation, tuple(group)) for group in groups]
    return sorted(runs, key=lambda run: -sum(float(unit.dimensions_m[0]) for unit in run.units))


def is_front(item: MeasuredObject) -> bool:
    """Whether it is a built-in unit that opens."""
    return built_in(item) and item.spec.opening != "rigid"


def cut(slab: Slab, obstacles: Sequence[Points], replaced_by: Sequence[Points] = ()) -> list[Slab]:
    """What is left of a slab along its run beside obstacles (corners in its frame), and away from what replaces it."""
    gone = [c for c in obstacles if all(meet(slab, c, axis) for axis in (1, 2))]
    gone += [c for c in replaced_by if meet(slab, c, 1)]
    pieces: list[Interval] = [(float(slab.low[0]), float(slab.high[0]))]
    for corners in gone:
        start, end = float(corners[:, 0].min()) - CLEAR_M, float(corners[:, 0].max()) + CLEAR_M
        pieces = [p for low, high in pieces for p in ((low, min(high, start)), (max(low, end), high))]
        pieces = [(low, high) for low, high in pieces if high - low >= _SHORTEST_M]
    return [replace(slab, low=np.array([low, *slab.low[1:]]), high=np.array([high, *slab.high[1:]])) for low, high in pieces]


def most_common(values: np.ndarray, areas: np.ndarray, *, least: float) -> float | None:
    """The value with most area within BAND_M of it, as the median of that; None where that is too little."""
    if len(values) == 0:
        return None
    edges = np.arange(values.min() - BAND_M, values.max() + BAND_M, 0.002)
    near = np.array([areas[np.abs(values - edge) < BAND_M].sum() for edge in edges])
    if near.max() < least:
        return None
    chosen = np.abs(values - edges[int(np.argmax(near))]) < BAND_M
    order = np.argsort(values[chosen])
    summed = np.cumsum(areas[chosen][order])
    return float(values[chosen][order][np.searchsorted(summed, summed[-1] / 2)])


def median_colour(colours: Points) -> Colour:
    """The middle of each channel, 0..1."""
    red, green, blue = np.median(colours, axis=0)
    return float(red), float(green), float(blue)


def extent(item: MeasuredObject, rotation: Matrix3, axis: int) -> Interval:
    """Where an object lies along an axis of a frame that is turned against the world."""
    along = corners_of(item, rotation)[:, axis]
    return float(along.min()), float(along.max())


def corners_of(item: MeasuredObject, rotation: Matrix3) -> Points:
    """An object's box (8, 3) in a frame that is turned against the world."""
    return np.asarray(item.world_from_object.apply(box_corners(item.dimensions_m)) @ rotation)


def overlap(a: Interval, b: Interval) -> float:
    """By how much two intervals overlap; negative where they are apart."""
    return min(a[1], b[1]) - max(a[0], b[0])


def _one_run(a: MeasuredObject, b: MeasuredObject, side: int) -> bool:
    levels = extent(a, np.eye(3), 2)[side] - extent(b, np.eye(3), 2)[side]
    return flush(a, b) and abs(levels) < _STEP_M


def flush(a: MeasuredObject, b: MeasuredObject) -> bool:
    """Whether both fronts are about in one plane."""
    apart = float((a.front_centre - b.front_centre) @ a.outward)
    return float(a.outward @ b.outward) > 1 - 1e-3 and abs(apart) < _FLUSH_M


def meet(slab: Slab, corners: Points, axis: int) -> bool:
    """Whether a slab and corners in its frame overlap along an axis."""
    return bool(corners[:, axis].min() < slab.high[axis] and corners[:, axis].max() > slab.low[axis])
