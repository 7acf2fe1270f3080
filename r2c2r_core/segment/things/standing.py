"""Floor-standing objects cut whole from depth voxels: chairs with seat and back, tables with top and legs.

A cut along concave creases separates a box from the table under it, but also a back from its seat. From an object whose
category stands on the floor, only foreign surface is therefore cut off: the floor, walls, other large level surfaces, negative
clicks and, where its slab is its highest part, objects on that slab.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.least_squares import fit_linear, geman_mcclure
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.depth_cloud import DepthCloud, Region, gather_cloud
from r2c2r_core.segment.things.min_cut import VoxelGraph, cut, touching
from r2c2r_core.segment.things.thing import Params as ThingParams
from r2c2r_core.segment.things.thing import Thing, ThingConfig
from r2c2r_core.tuning import param, tuned

UNKNOWN, ON, OFF = 0, 1, 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of floor-standing objects."""

    voxels_along: float = param(70, "count", "Number of voxels along the object's longest side", gt=0)
    voxel_range_m: tuple[float, float] = param((0.012, 0.025), "m", "Minimum and maximum voxel size")
    off_floor_m: float = param(0.02, "m", "Maximum height above the floor of points that belong to the floor")
    floor_slack_m: float = param(
        0.08, "m", "Maximum height difference between the floor and the room's floor plane: terraces slope"
    )
    gap_m: float = param(0.06, "m", "Maximum gap between parts of one object: sensors lose dark and thin pieces")
    level_cos: float = param(0.92, "cosine", "Minimum cosine between a face normal and up for a level surface")
    large_m2: float = param(0.45, "m²", "Minimum area of a level surface without a click for it to belong to another object")
    off_slab_m: float = param(
        0.015, "m", "Maximum height above a slab of points that belong to it; higher ones belong to objects on it"
    )
    slab_m: float = param(0.08, "m", "Maximum thickness of a slab with its apron")
    rim_m: float = param(0.03, "m", "Maximum distance of legs beyond the observed edge of a slab")
    hidden_m: float = param(0.12, "m", "Radius of the morphological closing that bridges objects hiding part of a slab")
    leg_m: float = param(0.15, "m", "Maximum width of a leg")


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """A segmented floor-standing object, and the label of each voxel around it: ON, OFF or UNKNOWN."""

    thing: Thing
    region: Region
    size_m: float
    labels: np.ndarray  # (x, y, z) uint8
    floor: np.ndarray  # (a, b, c): its height is a x + b y + c
    top_z_m: float | None  # of a slab that is its highest part

    def label_of(self, points: Points) -> np.ndarray:
        """Labels of world points (..., 3): ON, OFF or UNKNOWN; OFF outside the region."""
        params = tuned(Params)
        at = np.floor((points - self.region.low) / self.size_m).astype(int)
        inside = ((at >= 0) & (at < self.labels.shape)).all(axis=-1)
        at = np.where(inside[..., None], at, 0)
        label = np.where(inside, self.labels[at[..., 0], at[..., 1], at[..., 2]], OFF)
        low = points[..., 2] < _height_of(self.floor, points) + params.off_floor_m
        high = points[..., 2] > self.top_z_m + params.off_slab_m if self.top_z_m is not None else np.zeros_like(low)
        return np.asarray(np.where(low | high, OFF, label))


def find_standing(
    scene: Scene, positives: Points, negatives: Points, config: ThingConfig, structure: tuple[PlaneRegion, ...]
) -> Standing | None:
    """Floor-standing object at the clicks (world points); None without a floor, or where depth shows too little."""
    params = tuned(Params)
    if not scene.capture.room.floor_found:
        return None
    size = float(np.clip(2 * config.radius_m / params.voxels_along, *params.voxel_range_m))
    reach = 2 * config.radius_m + tuned(ThingParams).seed_m
    low, high = positives.min(axis=0) - reach, positives.max(axis=0) + reach
    low[2], high[2] = -params.floor_slack_m, max(config.tallest_m, float(positives[:, 2].max())) + tuned(ThingParams).seed_m
    levels = _level_cells(scene, low, high, size)
    top = _slab_at(levels, positives, low, size) if config.flat_top else None
    region = Region(low=low, high=high, level_z_m=top[1] if top is not None else 0.0)
    cloud = gather_cloud(scene, region, size)
    if len(cloud.positions) < 50:
        return None
    floor = _fit_floor(cloud)
    above = cloud.positions[:, 2] > _height_of(floor, cloud.positions) + params.off_floor_m
    on = (
        _of_slab(cloud, above, *top)
        if top is not None
        else _cut_off(cloud, above, levels, positives, negatives, config, structure)
    )
    if on is None or on.sum() < 30:
        return None
    labels = _labels(cloud, on, np.ceil((high - low) / size).astype(int) + 1)
    at = cloud.positions[on]
    middle = np.array([[*at[:, :2].mean(axis=0), 0.0]])
    thing = Thing(at, np.zeros((0, 3), np.int64), float(_height_of(floor, middle)[0]), size)
    return Standing(thing, region, size, labels, floor, top[1] if top is not None else None)


def _cut_off(
    cloud: DepthCloud,
    above: np.ndarray,
    levels: np.ndarray,
    positives: Points,
    negatives: Points,
    config: ThingConfig,
    structure: tuple[PlaneRegion, ...],
) -> np.ndarray | None:
    """Min-cut of the voxels above the floor that the clicks select; None where none is near a click."""
    params, shared = tuned(Params), tuned(ThingParams)
    members = np.flatnonzero(above)
    at, size = cloud.positions[members], cloud.size_m
    if len(members) == 0:
        return None
    span = cloud.cells.max(axis=0) + 3
    flat = ((cloud.cells[members, 0] + 1) * span[1] + cloud.cells[members, 1] + 1) * span[2] + cloud.cells[members, 2] + 1
    order = np.argsort(flat)
    members, at, flat = members[order], at[order], flat[order]
    upright = np.tile([0.0, 0.0, 1.0], (len(at), 1))  # no creases
    area = np.full(len(at), size**2)
    graph = VoxelGraph(at, upright, cloud.lab[members], area, touching(flat, span), np.zeros(0, np.int64), size)
    seeds = [graph.nearest(point) for point in positives]
    near = np.linalg.norm(at[seeds] - positives, axis=1) < shared.seed_m
    seeds = [seed for seed, is_near in zip(seeds, near, strict=True) if is_near]
    if not seeds:
        return None
    refused = [voxel for voxel in (graph.nearest(point) for point in negatives) if voxel not in seeds]
    others = _large_levels(levels, positives, cloud)[members]
    for plane in structure:
        on_plane = np.abs((at - plane.world_from_plane.translation) @ plane.outward) < shared.off_wall_m
        others |= on_plane & plane.supports(at, 0.10)
    others[seeds] = False
    chosen, _ = cut(graph, seeds, refused, config.radius_m, others, gap_m=params.gap_m, upright=True)
    on = np.zeros(len(above), bool)
    on[members[chosen]] = True
    return on


def _of_slab(cloud: DepthCloud, above: np.ndarray, footprint: np.ndarray, level_m: float) -> np.ndarray:
    """Mask of the voxels above the floor on a slab or on the slender legs under it."""
    from scipy import ndimage

    params = tuned(Params)
    rim = max(1, round(params.rim_m / cloud.size_m))
    under = ndimage.binary_dilation(footprint, iterations=rim)
    column = above & under[cloud.cells[:, 0], cloud.cells[:, 1]]
    height = cloud.positions[:, 2] - level_m
    own = footprint[cloud.cells[:, 0], cloud.cells[:, 1]]
    slab = own & (height < params.off_slab_m) & (height > -params.slab_m)
    below = column & (height <= -params.slab_m)
    return slab | _legs(cloud, below, level_m)


def _legs(cloud: DepthCloud, below: np.ndarray, level_m: float) -> np.ndarray:
    """Mask of the voxels below a slab that are slender at each height and reach up to the slab together."""
    from scipy import ndimage

    params = tuned(Params)
    filled = np.zeros(cloud.cells.max(axis=0) + 1, bool)
    filled[tuple(cloud.cells[below].T)] = True
    level = np.zeros((3, 3, 3), bool)
    level[:, :, 1] = True
    slices, _ = ndimage.label(filled, level)
    spans = [max(s.stop - s.start for s in found[:2]) for found in ndimage.find_objects(slices)]
    slender = np.array([False, *(span * cloud.size_m < params.leg_m for span in spans)])
    labels, _ = ndimage.label(slender[slices], np.ones((3, 3, 3)))
    of = labels[tuple(cloud.cells.T)]
    legs = np.zeros(len(of), bool)
    for part in np.unique(of[of > 0]):
        member = of == part
        if cloud.positions[member, 2].max() > level_m - params.slab_m - params.gap_m:
            legs |= member
    return legs


def _level_cells(scene: Scene, low: np.ndarray, high: np.ndarray, size: float) -> np.ndarray:
    """Labels (x, y, z) of the connected level parts of the fused surface in voxels; 0 elsewhere."""
    from scipy import ndimage

    parts = scene.parts
    middle, reach = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    faces = parts.faces_near(middle, reach)
    at = parts.middles[faces]
    level = (parts.normals[faces, 2] > tuned(Params).level_cos) & ((at > low) & (at < high)).all(axis=1)
    cells = np.floor((at[level] - low) / size).astype(int)
    filled = np.zeros(np.ceil((high - low) / size).astype(int) + 1, bool)
    filled[tuple(cells.T)] = True
    return np.asarray(ndimage.label(filled, np.ones((3, 3, 3)))[0])


def _slab_at(levels: np.ndarray, positives: Points, low: np.ndarray, size: float) -> tuple[np.ndarray, float] | None:
    """Plan (x, y) of the level part under the clicks, filled under objects on it, and its height; None without one."""
    from scipy import ndimage

    params = tuned(Params)
    reach = int(np.ceil(tuned(ThingParams).seed_m / size))
    votes: list[int] = []
    for point in positives:
        at = np.clip(np.floor((point - low) / size).astype(int), 0, np.array(levels.shape) - 1)
        block = levels[tuple(slice(max(k - reach, 0), k + reach + 1) for k in at)]
        votes += np.unique(block[block > 0]).tolist()
    if not votes:
        return None
    sizes = np.bincount(levels.ravel())
    cells = np.argwhere(levels == max(set(votes), key=lambda vote: sizes[vote]))
    if len(cells) * size**2 < 0.1 * params.large_m2:
        return None
    plan = np.zeros(levels.shape[:2], bool)
    plan[cells[:, 0], cells[:, 1]] = True
    pad = max(1, round(params.hidden_m / size))
    closed = ndimage.binary_closing(np.pad(plan, pad + 1), iterations=pad)[pad + 1 : -pad - 1, pad + 1 : -pad - 1]
    height = low[2] + (np.median(cells[:, 2]) + 0.5) * size
    return np.asarray(ndimage.binary_fill_holes(closed)), float(height)


def _large_levels(levels: np.ndarray, positives: Points, cloud: DepthCloud) -> np.ndarray:
    """Mask of the voxels on large level surfaces without a click: other tables, worktops."""
    from scipy import ndimage

    params = tuned(Params)
    sizes = np.bincount(levels.ravel()) * cloud.size_m**2
    large = sizes > params.large_m2
    large[0] = False
    for point in positives:
        at = np.floor((point - cloud.origin) / cloud.size_m).astype(int)
        block = levels[tuple(slice(max(k - 3, 0), k + 4) for k in at)]
        large[np.unique(block)] = False
    grown = ndimage.binary_dilation(large[levels], iterations=1)
    return np.asarray(grown[tuple(cloud.cells.T)])


def _labels(cloud: DepthCloud, on: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Label of each voxel of the region; unseen voxels next to the object count as ON, because of pose error."""
    from scipy import ndimage

    labels = np.full(shape, UNKNOWN, np.uint8)
    labels[tuple(cloud.cells[~on].T)] = OFF
    labels[tuple(cloud.cells[on].T)] = ON
    near = ndimage.binary_dilation(labels == ON, np.ones((3, 3, 3)))
    labels[near & (labels == UNKNOWN)] = ON
    return labels


def _fit_floor(cloud: DepthCloud) -> np.ndarray:
    """Floor plane (a, b, c) of nearby voxels by reweighted least squares; the room's floor where voxels are few."""
    params = tuned(Params)
    at = cloud.positions[np.abs(cloud.positions[:, 2]) < params.floor_slack_m]
    if len(at) < 100:
        return np.zeros(3)
    system = np.column_stack([at[:, :2], np.ones(len(at))])
    return fit_linear(system, at[:, 2], geman_mcclure, 0.01, rounds=15)[0]


def _height_of(floor: np.ndarray, points: Points) -> np.ndarray:
    """Height of the floor under points (..., 3)."""
    return np.asarray(points[..., :2] @ floor[:2] + floor[2])
