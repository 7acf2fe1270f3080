"""Triangles of the scan as area-weighted samples: position, direction, area and colour of its surfaces."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Matrix3, Points
from r2c2r_core.geometry.meshes import face_areas, face_normals
from r2c2r_core.model.capture import SceneSurface
from r2c2r_core.tuning import param, tuned

Colour = tuple[float, float, float]  # 0..1


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of planar surfaces."""

    band_m: float = param(0.01, "m", "Distance from the most common position within which surface belongs to one plane")


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """Centres and unit normals (n, 3), areas (n,), colours (n, 3) 0..1, of triangles; in one frame."""

    middles: Points
    normals: Points
    areas: np.ndarray
    colours: np.ndarray

    @property
    def area_m2(self) -> float:
        """Total area."""
        return float(self.areas.sum())

    @property
    def colour(self) -> Colour:
        """Median of each channel."""
        red, green, blue = np.median(self.colours, axis=0)
        return float(red), float(green), float(blue)

    def where(self, chosen: np.ndarray) -> "Facets":
        """The facets selected by a mask."""
        return Facets(self.middles[chosen], self.normals[chosen], self.areas[chosen], self.colours[chosen])

    def turned(self, world_from_new: Matrix3) -> "Facets":
        """The same facets, given in the world, in a rotated frame."""
        return Facets(self.middles @ world_from_new, self.normals @ world_from_new, self.areas, self.colours)

    def within(self, axis: int, low: float, high: float) -> np.ndarray:
        """Mask of the facets that lie between two values along an axis."""
        return np.asarray((self.middles[:, axis] > low) & (self.middles[:, axis] < high))


def facets_of(surface: SceneSurface) -> Facets:
    """The scan's triangles, in the world."""
    if len(surface.faces) == 0:
        return Facets(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)))
    vertices = np.asarray(surface.vertices_world, dtype=np.float64)
    return Facets(
        vertices[surface.faces].mean(axis=1),
        face_normals(vertices, surface.faces),
        face_areas(vertices, surface.faces),
        surface.colours[surface.faces].mean(axis=1) / 255.0,
    )


def most_common(values: np.ndarray, areas: np.ndarray, *, least: float) -> float | None:
    """Area-weighted mode of the values, refined by the median within `band_m` of it; None if its area is too small."""
    params = tuned(Params)
    if len(values) == 0:
        return None
    edges = np.arange(values.min() - params.band_m, values.max() + params.band_m, 0.002)
    near = np.array([areas[np.abs(values - edge) < params.band_m].sum() for edge in edges])
    if near.max() < least:
        return None
    chosen = np.abs(values - edges[int(np.argmax(near))]) < params.band_m
    order = np.argsort(values[chosen])
    summed = np.cumsum(areas[chosen][order])
    return float(values[chosen][order][np.searchsorted(summed, summed[-1] / 2)])
