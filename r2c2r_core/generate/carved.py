"""Things of any shape: a prior solid, carved by free space and silhouettes, with the fused surface where it was seen.

Recipe of backends.md §2.6 and stack.md §8. Every field is a distance in metres, positive outside, on a grid in the thing's
own gravity-aligned frame, so the zero level is a closed surface whatever was not seen.
"""

from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.consistency import silhouette_iou
from r2c2r_core.generate.evidence import Evidence, masked_points
from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.symmetry import Revolution, best_mirror
from r2c2r_core.generate.variation import Variation
from r2c2r_core.generate.votes import grid_votes
from r2c2r_core.geometry.meshes import largest_component, simplify, volume
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z

_MOST_VOXELS = 1_000_000
_MOST_CELLS = 160  # along the longest side: 6 mm on a chair
_TRUNCATION_VOXELS = 3.0
_LEAST_TRUNCATION_M = 0.012  # LiDAR noise and pose error together
_OUTWARDS_M, _INWARDS_M = (0.002, 0.004), (-0.002, -0.004)
_MOST_FACES = 6000
_LEAST_POINTS = 60
_COMPONENT_CELL_M = 0.03


class Grid(NamedTuple):
    """Voxel centres low + (i + 0.5) * voxel in the local frame."""

    low: Vector3
    shape: tuple[int, int, int]
    voxel_m: float

    def centres(self) -> Points:
        """All voxel centres (n, 3), last axis fastest."""
        axes = [self.low[k] + (np.arange(self.shape[k]) + 0.5) * self.voxel_m for k in range(3)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


class Seen(NamedTuple):
    """What the frames of one draw show of a thing, in its box's frame (gravity-aligned, origin at the box's centre)."""

    world_from_local: Rigid3
    points: Points
    low: Vector3  # corners of what is carved
    high: Vector3
    floor: float | None  # the height it stands on; None where unknown


def observe_thing(evidence: Evidence, variation: Variation) -> Seen:
    """The thing's points and box; raises GenerationFailed where there is too little depth."""
    world_from_local = _local_frame(evidence)
    points = _object_points(evidence, variation, world_from_local)
    return Seen(world_from_local, points, *_prior_box(evidence, variation, points, world_from_local))


def carved_shape(evidence: Evidence, variation: Variation, seen: Seen, revolution: Revolution | None) -> Shape:
    """The solid that masks and free space leave, with the seen surface; about `revolution`'s axis where there is one."""
    low, high = seen.low, seen.high
    if revolution is not None:
        low, high = _around(revolution, low, high)
    margin = max(0.006, 1.5 * variation.voxel_m)
    grid = _grid(low, high, variation.voxel_m, margin)
    field, mirrored = _solid_field(grid, low - margin, high + margin, revolution, variation, seen.world_from_local)
    vertices, faces, level = _best_level(grid, field, seen.floor, evidence, variation, seen.world_from_local)
    parameters = {"revolved": float(revolution is not None), "mirrored": float(mirrored), "level_m": level}
    return Shape(
        vertices_local=vertices,
        faces=faces,
        world_from_local=seen.world_from_local,
        front_y_m=None,
        maskable=np.ones(len(faces), dtype=bool),
        parameters=parameters,
        warnings=(),
    )


def _local_frame(evidence: Evidence) -> Rigid3:
    """The track's box frame; without one, a frame along the room's dominant directions at the middle of the points."""
    if evidence.track.box is not None:
        return evidence.track.box.world_from_object
    points = np.concatenate([masked_points(v) for v in evidence.pool])
    if len(points) < _LEAST_POINTS:
        raise GenerationFailed(
            f"{evidence.track.name}: {len(points)} depth points inside its masks", hint="scan it from nearer"
        )
    return Rigid3(rotation_about_z(evidence.capture.room.manhattan_yaw_rad), np.median(points, axis=0))


def _object_points(evidence: Evidence, variation: Variation, world_from_local: Rigid3) -> Points:
    """Depth points of the object in the local frame: its largest connected piece."""
    found = [masked_points(view, variation.erosion_px) for view in variation.views]
    points = world_from_local.inverse.apply(np.concatenate(found))
    if len(points) < _LEAST_POINTS:
        raise GenerationFailed(
            f"{evidence.track.name}: {len(points)} depth points inside its masks, {_LEAST_POINTS} needed",
            hint="scan it from nearer, or upload a mesh",
        )
    return _largest_cluster(points)


def _largest_cluster(points: Points) -> Points:
    """The points of the largest component of coarse occupied cells: what shines through slats or past edges falls off."""
    from scipy import ndimage

    cell = np.floor((points - points.min(axis=0)) / _COMPONENT_CELL_M).astype(int)
    counts = np.zeros(cell.max(axis=0) + 1, dtype=np.int64)
    np.add.at(counts, tuple(cell.T), 1)
    labels, count = ndimage.label(counts >= 2, structure=np.ones((3, 3, 3)))
    if count <= 1:
        return points
    sizes = ndimage.sum(counts, labels, index=np.arange(1, count + 1))
    return points[labels[tuple(cell.T)] == 1 + int(np.argmax(sizes))]


def _prior_box(
    evidence: Evidence, variation: Variation, points: Points, world_from_local: Rigid3
) -> tuple[Vector3, Vector3, float | None]:
    """Corners of the solid that is carved, and the height it stands on (local), None where unknown."""
    percentile = variation.bbox_percentile
    low, high = np.percentile(points, percentile, axis=0), np.percentile(points, 100 - percentile, axis=0)
    box = evidence.track.box
    if box is None:
        return low, high, None
    half = np.asarray(box.dimensions_m) / 2
    eyes = world_from_local.inverse.apply(np.array([v.eye_world for v in variation.views]))
    for axis in (0, 1):  # a side no camera looks at keeps the track's box, when that reaches further
        if not (eyes[:, axis] > half[axis]).any():
            high[axis] = max(high[axis], half[axis] * variation.depth_scale)
        if not (eyes[:, axis] < -half[axis]).any():
            low[axis] = min(low[axis], -half[axis] * variation.depth_scale)
    floor = box.support_z_m - float(world_from_local.translation[2])
    if low[2] - floor > 0.5 * (high[2] - low[2]):  # hangs or stands on something else
        return low, high, None
    low[2] = floor
    return low, high, floor


def _around(revolution: Revolution, low: Vector3, high: Vector3) -> tuple[Vector3, Vector3]:
    """The box of a body of revolution, at the heights of the points."""
    radius = float(revolution.radii_m.max())
    low, high = low.copy(), high.copy()
    low[:2], high[:2] = revolution.centre - radius, revolution.centre + radius
    return low, high


def _grid(low: Vector3, high: Vector3, voxel_m: float, margin_m: float) -> Grid:
    """A grid over the box with a margin and two voxels of air."""
    start, size = low - margin_m - 2 * voxel_m, high - low + 2 * margin_m + 4 * voxel_m
    voxel_m = max(voxel_m, float(size.max()) / _MOST_CELLS, float(np.cbrt(np.prod(size) / _MOST_VOXELS)))
    counts = np.ceil(size / voxel_m).astype(int) + 1
    return Grid(start, (int(counts[0]), int(counts[1]), int(counts[2])), voxel_m)


def _solid_field(
    grid: Grid,
    low: Vector3,
    high: Vector3,
    revolution: Revolution | None,
    variation: Variation,
    world_from_local: Rigid3,
) -> tuple[np.ndarray, bool]:
    """Distance field (positive outside) of the completed solid, and whether a mirror completed it."""
    from scipy import ndimage

    centres = grid.centres()
    truncation = max(_TRUNCATION_VOXELS * grid.voxel_m, _LEAST_TRUNCATION_M)
    votes = grid_votes(centres, grid.shape, grid.voxel_m, variation, truncation, world_from_local)
    bounds = np.maximum(low - centres, centres - high).max(axis=1)
    prior = np.maximum(bounds, revolution.signed_distance(centres)) if revolution is not None else bounds
    prior = np.clip(prior, -truncation, truncation)
    seen = np.isfinite(votes.distance_m)
    free = votes.free_m > 0
    # what lies in no mask, but behind another thing in every frame, is nobody's guess: leave it out
    field = np.where(seen, votes.distance_m, np.maximum(prior, votes.outside_m))
    field = np.where(free, np.maximum(field, np.minimum(votes.free_m, truncation)), field)
    field = np.maximum(field, np.clip(bounds, -truncation, truncation))
    volume_field = field.reshape(grid.shape)
    mirrored = revolution is None and _mirror_unseen(
        volume_field,
        (seen | free).reshape(grid.shape),
        free.reshape(grid.shape),
        (~seen & ~free & (votes.outside_m > 0)).reshape(grid.shape),
    )
    solid = volume_field < 0
    slivers = solid & ~ndimage.binary_opening(solid, iterations=2) & ~seen.reshape(grid.shape)
    volume_field[slivers] = grid.voxel_m  # what is left between two silhouettes and was never seen as a surface
    return ndimage.gaussian_filter(volume_field, 0.7), mirrored


def _mirror_unseen(field: np.ndarray, seen: np.ndarray, free: np.ndarray, hidden: np.ndarray) -> bool:
    """Give voxels that nobody saw, in place, what their mirror twins were seen to be; the middle is the grid's own.

    Free twins carve; solid twins fill only what is `hidden` behind other things.
    """
    from scipy import ndimage

    axis = best_mirror(field < 0, seen, free)
    if axis is None:
        return False
    twin, twin_seen, twin_free = (np.flip(values, axis).copy() for values in (field, seen, free))
    filled = ndimage.binary_opening(hidden & twin_seen & (twin < 0), iterations=2)  # slivers are masks that disagree
    changed = (~seen & twin_free) | filled
    field[changed] = twin[changed]
    return bool(changed.any())


def _best_level(
    grid: Grid, field: np.ndarray, floor: float | None, evidence: Evidence, variation: Variation, world_from_local: Rigid3
) -> tuple[Points, Faces, float]:
    """The surface at the level, within ±4 mm, whose silhouettes agree best with the masks: masks and votes err to one side."""
    views = variation.views[:: max(len(variation.views) // 5, 1)]
    best: tuple[float, float, Points, Faces] | None = None
    for levels in ((0.0,), _OUTWARDS_M, _INWARDS_M):  # the agreement has one peak: climb it
        for level in levels:
            extracted = _extract(grid, field, level, floor)
            if extracted is None:
                break
            score = silhouette_iou(world_from_local.apply(extracted[0]), extracted[1], views)
            if best is not None and score <= best[0]:
                break
            best = (score, level, *extracted)
        if best is not None and best[1] > 0:
            break
    if best is None:
        raise GenerationFailed(f"{evidence.track.name}: carving left nothing", hint="its masks disagree; add a click")
    _, level, vertices, faces = best
    try:
        return *simplify(vertices, faces, 0.25 * grid.voxel_m, _MOST_FACES), level
    except ValueError as error:
        raise GenerationFailed(f"{evidence.track.name}: {error}") from error


def _extract(grid: Grid, field: np.ndarray, level: float, floor: float | None) -> tuple[Points, Faces] | None:
    """Largest closed surface field = level, in the local frame; None where the field nowhere goes below it."""
    from skimage.measure import marching_cubes

    shifted = field - level
    if floor is not None:  # the level must not lift the thing off its support
        shifted = np.maximum(shifted, floor - (grid.low[2] + (np.arange(grid.shape[2]) + 0.5) * grid.voxel_m))
    padded = np.pad(shifted, 1, constant_values=grid.voxel_m)
    padded[np.abs(padded) < 1e-7] = 1e-7  # a vertex exactly on a voxel centre would be duplicated
    if not (padded < 0).any():
        return None
    vertices, faces, _, _ = marching_cubes(padded, 0.0)
    local = grid.low + (vertices.astype(np.float64) - 0.5) * grid.voxel_m
    local, joined = largest_component(local, faces.astype(np.int64))
    return local, joined if volume(local, joined) > 0 else joined[:, ::-1]
