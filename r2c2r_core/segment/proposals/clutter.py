"""Free-standing clusters of the fused surface, which stand on a level support and belong to no vertical plane."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from r2c2r_core.arrays import Points
from r2c2r_core.model.capture import Capture
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.things.thing import Params as ThingParams
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of free-standing clusters."""

    voxel_m: float = param(0.02, "m", "Side of the voxels that connect a cluster", gt=0)
    map_m: float = param(0.04, "m", "Cell size of the map of level surfaces", gt=0)
    level_cos: float = param(0.85, "cosine", "Minimum cosine between a normal and up for a level surface")
    least_level_m2: float = param(0.05, "m²", "Minimum area of a support", source="glossy worktops lose most of their depth")
    beside_m: float = param(
        0.20, "m", "Maximum distance of an object from the observed part of its support: the object hides the rest"
    )
    stands_m: float = param(0.06, "m", "Maximum height above its support of the lowest observed part of an object")
    off_plane_m: float = param(0.03, "m", "Maximum distance from a vertical plane of surface that belongs to it")
    structure_m2: float = param(0.12, "m²", "Minimum area of a vertical plane: smaller ones may be the face of a box")
    beside_plane_m: float = param(
        0.04, "m", "Maximum distance in the plane from a vertical plane's observed part of surface that belongs to it"
    )
    bin_m: float = param(0.01, "m", "Bin size of the height histogram", gt=0)
    level_m: float = param(0.02, "m", "Maximum height difference of surface from the level surface that it belongs to")
    reach_m: float = param(1.3, "m", "Maximum height above its support at which an object is searched")
    apart_m: float = param(0.05, "m", "Minimum distance between the centres of two objects")
    shown: float = param(0.5, "ratio", "Observed surface relative to half an object's box at which the confidence saturates")
    sure_height_m: float = param(0.08, "m", "Height of an object at which the confidence saturates")
    surest: float = param(0.9, "score", "Maximum confidence of an object")
    on_floor_m: float = param(0.15, "m", "Height below which a support is the floor")
    floor_most_m: tuple[float, float] = param(
        (1.2, 1.3), "m", "Maximum width and height of an object on the floor: larger ones are built in"
    )
    table_most_m: tuple[float, float] = param(
        (0.6, 0.6), "m", "Maximum width and height of an object on a worktop: larger ones are built in"
    )
    least_m: tuple[float, float] = param(
        (0.15, 0.04), "m", "Minimum height of an object on the floor, and elsewhere: less is noise"
    )
    least_across_m: float = param(0.04, "m", "Minimum width of an object")


@dataclass(frozen=True, slots=True, eq=False)
class Clump:
    """A connected part of the scan, world frame."""

    points: Points
    extent_m: np.ndarray  # along the room's axes and up
    base_m: float  # world height of its support
    confidence: float


def find_clumps(capture: Capture, planes: tuple[PlaneRegion, ...]) -> list[Clump]:
    """Clusters on level surfaces, the most confident first."""
    params = tuned(Params)
    surface = capture.surface
    corners = surface.vertices_world[surface.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(cross, axis=1) / 2
    centres, up = corners.mean(axis=1), cross[:, 2] / np.maximum(2 * areas, 1e-12)
    yaw = capture.room.manhattan_yaw_rad
    c, s = np.cos(yaw), np.sin(yaw)
    turned = centres @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])  # along the room's axes
    levels = _levels(turned, areas, up)
    if not levels:
        return []
    free = np.ones(len(centres), bool)
    for plane in planes:
        if plane.area_m2 > params.structure_m2:
            off = np.abs((centres - plane.world_from_plane.translation) @ plane.outward)
            free &= ~((off < params.off_plane_m) & plane.supports(centres, params.beside_plane_m))
    found = []
    for height, mask, origin in levels:
        found += _standing_on(height, mask, origin, centres[free], turned[free], areas[free])
    found.sort(key=lambda clump: -clump.confidence)
    kept: list[Clump] = []
    for clump in found:
        middle = clump.points.mean(axis=0)
        if all(np.linalg.norm(middle - other.points.mean(axis=0)) > params.apart_m for other in kept):
            kept.append(clump)
    return kept


def _levels(points: Points, areas: np.ndarray, up: np.ndarray) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Level surfaces as (height, map of their extent, map origin); overlapping heights are merged."""
    params = tuned(Params)
    level = up > params.level_cos
    if not level.any():
        return []
    heights = points[level, 2]
    low = heights.min()
    profile = np.bincount(((heights - low) / params.bin_m).astype(int), areas[level])
    smooth = ndimage.uniform_filter1d(np.pad(profile, 3), 3) * 3
    highest = ndimage.maximum_filter1d(smooth, 7)
    origin = points[:, :2].min(axis=0)
    shape = tuple(((points[:, :2].max(axis=0) - origin) / params.map_m).astype(int) + 2)
    found = []
    for peak in np.flatnonzero((smooth == highest) & (smooth > params.least_level_m2)):
        height = low + (peak - 3 + 0.5) * params.bin_m
        near = level & (np.abs(points[:, 2] - height) < params.level_m)
        cells = ((points[near, :2] - origin) / params.map_m).astype(int)
        seen = np.zeros(shape, bool)
        seen[cells[:, 0], cells[:, 1]] = True
        beside = np.asarray(ndimage.binary_dilation(seen, iterations=round(params.beside_m / params.map_m)))
        found.append((float(np.average(points[near, 2], weights=areas[near])), beside, origin))
    return found


def _standing_on(
    height: float, seen: np.ndarray, origin: np.ndarray, centres: Points, turned: Points, areas: np.ndarray
) -> list[Clump]:
    params = tuned(Params)
    cells = ((turned[:, :2] - origin) / params.map_m).astype(int)
    above = seen[cells[:, 0], cells[:, 1]] & (turned[:, 2] > height + tuned(ThingParams).clearance_m)
    above &= turned[:, 2] < height + params.reach_m
    if above.sum() < 10:
        return []
    points, local, area = centres[above], turned[above], areas[above]
    low = local.min(axis=0) - params.voxel_m
    index = ((local - low) / params.voxel_m).astype(int)
    filled = np.zeros(index.max(axis=0) + 3, bool)
    filled[index[:, 0] + 1, index[:, 1] + 1, index[:, 2] + 1] = True
    labels, count = ndimage.label(filled, np.ones((3, 3, 3)))
    own = labels[index[:, 0] + 1, index[:, 1] + 1, index[:, 2] + 1]
    found = []
    for label in range(1, count + 1):
        member = own == label
        if member.sum() < 12:
            continue
        bottom, top = np.quantile(local[member], 0.01, axis=0), np.quantile(local[member], 0.99, axis=0)
        extent = top - bottom
        extent[2] = top[2] - height
        if bottom[2] > height + params.stands_m or not _thing_sized(extent, height):
            continue
        # At best half of an object is observed: its surface is compared with half that of its box.
        shown = float(area[member].sum() / max(extent[0] * extent[1] / 2 + extent[2] * (extent[0] + extent[1]), 1e-4))
        tall = np.clip(extent[2] / params.sure_height_m, 0.3, 1)
        confidence = float(np.clip(shown / params.shown, 0.1, 1) * tall * params.surest)
        found.append(Clump(points[member], extent, height, confidence))
    return found


def _thing_sized(extent: np.ndarray, height: float) -> bool:
    """Whether a size is larger than noise and smaller than built-in furniture."""
    params = tuned(Params)
    on_floor, across = height < params.on_floor_m, float(extent[:2].max())
    most_across, most_high = params.floor_most_m if on_floor else params.table_most_m
    least = params.least_m[0] if on_floor else params.least_m[1]
    return bool(least < extent[2] < most_high and params.least_across_m < across < most_across)
