"""Distance fields on a grid, and their closed level-set surface that agrees best with the masks."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.consistency import silhouette_iou
from r2c2r_core.generate.variation import Variation
from r2c2r_core.geometry.meshes import largest_component, simplify, volume
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned resolution of distance fields and their surfaces."""

    most_voxels: int = param(1_000_000, "count", "Maximum number of voxels of a grid", ge=1000)
    most_cells: int = param(160, "count", "Maximum number of voxels along the longest side", source="6 mm on a chair", ge=8)
    most_faces: int = param(6000, "count", "Maximum number of triangles of the surface", ge=100)
    flatter: float = param(0.35, "ratio", "Maximum displacement by mesh simplification, in voxels")
    outwards_m: tuple[float, float] = param((0.002, 0.004), "m", "Levels that move the surface outwards, tried first")
    inwards_m: tuple[float, float] = param((-0.002, -0.004), "m", "Levels that move the surface inwards")


class Grid(NamedTuple):
    """Voxel centres low + (i + 0.5) * voxel in the local frame."""

    low: Vector3
    shape: tuple[int, int, int]
    voxel_m: float

    def centres(self) -> Points:
        """All voxel centres (n, 3), last axis fastest."""
        return np.stack(np.meshgrid(*map(self._along, range(3)), indexing="ij"), axis=-1).reshape(-1, 3)

    def heights(self) -> np.ndarray:
        """Z of each layer of voxel centres, along the last axis."""
        return self._along(2)

    def _along(self, axis: int) -> np.ndarray:
        return np.asarray(self.low[axis] + (np.arange(self.shape[axis]) + 0.5) * self.voxel_m)


def grid_round(low: Vector3, high: Vector3, voxel_m: float, margin_m: float) -> Grid:
    """A grid over the box with a margin and two voxels of air."""
    params = tuned(Params)
    start, size = low - margin_m - 2 * voxel_m, high - low + 2 * margin_m + 4 * voxel_m
    voxel_m = max(voxel_m, float(size.max()) / params.most_cells, float(np.cbrt(np.prod(size) / params.most_voxels)))
    counts = np.ceil(size / voxel_m).astype(int) + 1
    return Grid(start, (int(counts[0]), int(counts[1]), int(counts[2])), voxel_m)


def best_level(grid: Grid, field: np.ndarray, floor: float | None, variation: Variation, world_from_local: Rigid3) -> float:
    """Level of `field`, within ±4 mm, whose surface's silhouettes agree best with the masks, as votes are biased.

    `field` has the grid's shape and is positive outside. `floor` is the height of the object's support, if it is known.
    """
    params = tuned(Params)
    views = variation.views[:: max(len(variation.views) // 5, 1)]
    best, best_score = 0.0, -1.0
    for levels in ((0.0,), params.outwards_m, params.inwards_m):  # hill climbing: the agreement has a single peak
        for level in levels:
            extracted = _extract(grid, field, level, floor)
            score = -1.0 if extracted is None else silhouette_iou(world_from_local.apply(extracted[0]), extracted[1], views)
            if score <= best_score:
                break
            best, best_score = level, score
        if best > 0:
            break
    return best


def surface_at(grid: Grid, field: np.ndarray, level: float, floor: float | None) -> tuple[Points, Faces]:
    """Closed surface field = level in the local frame; raises GenerationFailed if it is empty."""
    params = tuned(Params)
    extracted = _extract(grid, field, level, floor)
    if extracted is None:
        raise GenerationFailed("carving left nothing", hint="its masks disagree; add a click")
    try:
        return simplify(*extracted, params.flatter * grid.voxel_m, params.most_faces)
    except ValueError as error:
        raise GenerationFailed(str(error), hint="its masks disagree; add a click") from error


def _extract(grid: Grid, field: np.ndarray, level: float, floor: float | None) -> tuple[Points, Faces] | None:
    """Largest closed surface field = level (marching cubes), in the local frame; None if the field is nowhere below it."""
    from skimage.measure import marching_cubes

    shifted = field - level
    if floor is not None:  # the level must not lift the object off its support
        shifted = np.maximum(shifted, floor - grid.heights())
    padded = np.pad(shifted, 1, constant_values=grid.voxel_m)
    padded[np.abs(padded) < 1e-7] = 1e-7  # a vertex exactly on a voxel centre would be duplicated
    if not (padded < 0).any():
        return None
    vertices, faces, _, _ = marching_cubes(padded, 0.0)
    local = grid.low + (vertices.astype(np.float64) - 0.5) * grid.voxel_m
    local, joined = largest_component(local, faces.astype(np.int64))
    return local, joined if volume(local, joined) > 0 else joined[:, ::-1]
