"""Floor-standing objects cut whole from depth voxels: chairs with seat and back, tables with top and legs; and worktops.

A cut along concave creases separates a box from the table under it, but also a back from its seat. From an object whose
category stands on the floor, only foreign surface is therefore cut off: the floor, walls, other large level surfaces, negative
clicks and, where its slab is its highest part, objects on that slab. A worktop is such a slab without legs.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.least_squares import fit_linear, geman_mcclure
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.depth_cloud import DepthCloud, Region, gather_cloud
from r2c2r_core.segment.things.min_cut import VoxelGraph, cut, touching
from r2c2r_core.segment.things.slab import Params as SlabParams
from r2c2r_core.segment.things.slab import Slab, arm_at, height_of, level_cells, plan_of
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
    large_m2: float = param(0.45, "m²", "Minimum area of a level surface without a click for it to belong to another object")
    slab_m: float = param(0.08, "m", "Maximum thickness of a slab with its apron")
    rim_m: float = param(
        0.03, "m", "Maximum distance of legs and of the slab itself beyond its observed edge: level faces end before it"
    )
    leg_m: float = param(0.15, "m", "Maximum width of a leg")


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """A segmented floor-standing object or worktop, and the label of each voxel around it: ON, OFF or UNKNOWN."""

    thing: Thing
    region: Region
    size_m: float
    labels: np.ndarray  # (x, y, z) uint8
    floor: np.ndarray  # (a, b, c): its height is a x + b y + c
    top: np.ndarray | None  # (a, b, c) of a slab that is its highest part

    def label_of(self, points: Points) -> np.ndarray:
        """Labels of world points (..., 3): ON, OFF or UNKNOWN; OFF outside the region."""
        params = tuned(Params)
        at = np.floor((points - self.region.low) / self.size_m).astype(int)
        inside = ((at >= 0) & (at < self.labels.shape)).all(axis=-1)
        at = np.where(inside[..., None], at, 0)
        label = np.where(inside, self.labels[at[..., 0], at[..., 1], at[..., 2]], OFF)
        foreign = points[..., 2] < height_of(self.floor, points) + params.off_floor_m
        if self.top is not None:
            foreign |= points[..., 2] > height_of(self.top, points) + tuned(SlabParams).off_slab_m
        return np.asarray(np.where(foreign, OFF, label))

    @property
    def levelled(self) -> Points:
        """Its points with the slab level: up may be off by 2 degrees, which lifts one end of a table by 7 cm."""
        points = self.thing.vertices.copy()
        if self.top is not None:
            tilt = height_of(self.top, points)
            points[:, 2] -= tilt - tilt.mean()
        return points


def find_standing(
    scene: Scene, positives: Points, negatives: Points, config: ThingConfig, structure: tuple[PlaneRegion, ...]
) -> Standing | None:
    """Floor-standing object or worktop at the clicks (world points); None without a floor, or where depth shows too little."""
    params, seed_m = tuned(Params), tuned(ThingParams).seed_m
    if config.slab_m is not None:
        return _find_worktop(scene, positives, config.slab_m, config)
    if not scene.capture.room.floor_found:
        return None
    low, high, size = _around(positives, config)
    low[2], high[2] = -params.floor_slack_m, max(config.tallest_m, float(positives[:, 2].max())) + seed_m
    levels = level_cells(scene, low, high, size)
    top = levels.slab_at(positives, seed_m) if config.flat_top else None
    region = Region(low=low, high=high, level=top.plane if top is not None else np.zeros(3))
    cloud = gather_cloud(scene, region, size)
    if len(cloud.positions) < 50:
        return None
    floor = _fit_floor(cloud)
    above = cloud.positions[:, 2] > height_of(floor, cloud.positions) + params.off_floor_m
    on = (
        _of_table(cloud, above, top)
        if top is not None
        else _cut_off(cloud, above, levels.labels, positives, negatives, config, structure)
    )
    return None if on is None else _standing(cloud, on, region, floor, top, lambda middle: height_of(floor, middle))


def _find_worktop(scene: Scene, positives: Points, thickness_m: float, config: ThingConfig) -> Standing | None:
    """Level slab at the clicks (world points) with its front edge, one arm of an L; None where depth shows too little of it."""
    params, seed_m = tuned(Params), tuned(ThingParams).seed_m
    low, high, size = _around(positives, config)
    low[2], high[2] = positives[:, 2].min() - 2 * seed_m, positives[:, 2].max() + 2 * seed_m
    top = level_cells(scene, low, high, size).slab_at(positives, seed_m, whole=True)
    if top is None:
        return None
    seen = scene.parts.middles[scene.parts.faces_near(positives[0], high[0] - positives[0, 0], any_height=True)]
    below = seen[:, 2] < height_of(top.plane, seen) - params.slab_m
    beside = plan_of(seen[below & ((seen > low) & (seen < high))[:, :2].all(axis=1)], low, size, top.plan.shape)
    top = replace(top, plan=arm_at(top.plan, beside, positives[0], low, size, scene.capture.room.manhattan_yaw_rad))
    region = Region(low=low, high=high, level=top.plane)
    cloud = gather_cloud(scene, region, size)
    on = _of_slab(cloud, top, thickness_m)[0]
    if on.sum() * size**2 < tuned(SlabParams).least_m2:  # gloss that depth shows some specks of
        return None
    nothing = np.array([0.0, 0.0, low[2] - params.off_floor_m])  # its floor: nothing below it matters
    return _standing(
        cloud,
        on,
        region,
        nothing,
        top,
        lambda middle: height_of(top.plane, middle) - thickness_m,
    )


def _around(positives: Points, config: ThingConfig) -> tuple[np.ndarray, np.ndarray, float]:
    """Ends of the box to search about the clicks, and the size of its voxels."""
    params, reach = tuned(Params), 2 * config.radius_m + tuned(ThingParams).seed_m
    size = float(np.clip(2 * config.radius_m / params.voxels_along, *params.voxel_range_m))
    return positives.min(axis=0) - reach, positives.max(axis=0) + reach, size


def _standing(
    cloud: DepthCloud,
    on: np.ndarray,
    region: Region,
    floor: np.ndarray,
    top: Slab | None,
    bottom_at: Callable[[Vector3], np.ndarray],
) -> Standing | None:
    """Object of some voxels of a cloud; None for too few."""
    if on.sum() < 30:
        return None
    labels = _labels(cloud, on, np.ceil((region.high - region.low) / cloud.size_m).astype(int) + 1)
    at = cloud.positions[on]
    thing = Thing(at, np.zeros((0, 3), np.int64), float(bottom_at(at.mean(axis=0))), cloud.size_m)
    return Standing(thing, region, cloud.size_m, labels, floor, top.plane if top is not None else None)


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


def _of_table(cloud: DepthCloud, above: np.ndarray, top: Slab) -> np.ndarray:
    """Mask of the voxels above the floor on a slab or on the slender legs under it."""
    params = tuned(Params)
    slab, near, height = _of_slab(cloud, top, params.slab_m)
    return slab | _legs(cloud, above & near & (height <= -params.slab_m), height)


def _of_slab(cloud: DepthCloud, top: Slab, thickness_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masks of the voxels on a slab and of those over or under it, and the height of each above it."""
    from scipy import ndimage

    params, (x, y, _) = tuned(Params), cloud.cells.T
    height = cloud.positions[:, 2] - height_of(top.plane, cloud.positions)
    near = ndimage.binary_dilation(top.plan, iterations=max(1, round(params.rim_m / cloud.size_m)))[x, y]
    lowest = np.where(top.plan[x, y], -thickness_m, -tuned(SlabParams).off_slab_m)
    return near & (height > lowest) & (height < tuned(SlabParams).off_slab_m), near, height


def _legs(cloud: DepthCloud, below: np.ndarray, height: np.ndarray) -> np.ndarray:
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
        if height[member].max() > -params.slab_m - params.gap_m:
            legs |= member
    return legs


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
