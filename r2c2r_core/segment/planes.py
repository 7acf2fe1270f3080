"""Vertical planes of the fused surface by Hough voting on yaw and offset: fronts of furniture runs, once, before any click."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy import ndimage

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.model.capture import SceneSurface
from r2c2r_core.segment.surface import face_normals
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What a front's plane is."""

    cell_m: float = param(0.02, "m", "side of the support map's cells", gt=0)
    normal_cos: float = param(
        float(np.cos(np.radians(22))),
        "cosine",
        "with a plane's direction: 22 degrees",
        source="TSDF normals of noisy scans scatter",
    )
    yaw_bins: int = param(360, "count", "of a full turn", ge=36)
    offset_bin_m: float = param(0.005, "m", "of offsets that are counted together", gt=0)
    thickness_m: float = param(0.025, "m", "points this near a plane belong to it")
    bridge_m: float = param(0.10, "m", "holes a thing in front leaves in a run")
    smallest_m2: float = param(0.015, "m²", "of a plane", source="the keypad of a microwave whose glass gives no depth")


@dataclass(frozen=True, slots=True, eq=False)
class PlaneRegion:
    """One connected flat vertical part of the scan; `world_from_plane` is a `front` frame at its middle."""

    world_from_plane: Rigid3
    width_m: float
    height_m: float
    support: np.ndarray  # bool, row 0 at the top, cells of `cell_m`
    cell_m: float
    area_m2: float
    _grown: dict[float, np.ndarray] = field(
        default_factory=dict, init=False, repr=False
    )  # by reach: clicks ask for the same few

    @property
    def outward(self) -> Vector3:
        """Unit normal, towards the room."""
        return -self.world_from_plane.rotation[:, 1]

    @property
    def points(self) -> Points:
        """World points (n, 3) of the cells that were seen."""
        row, column = np.nonzero(self.support)
        x = (column + 0.5) * self.cell_m - self.width_m / 2
        z = self.height_m / 2 - (row + 0.5) * self.cell_m
        return self.world_from_plane.apply(np.stack([x, np.zeros(len(x)), z], axis=1))

    def supports(self, points_world: Points, reach_m: float) -> np.ndarray:
        """Which points (n, 3) lie within `reach_m` of the seen part, measured in the plane."""
        local = self.world_from_plane.inverse.apply(points_world)
        margin = int(np.ceil(reach_m / self.cell_m)) + 1
        grown = self._grown.get(reach_m)
        if grown is None:
            grown = np.pad(self.support.astype(np.uint8), margin)
            if reach_m > 0:
                grown = cv2.dilate(grown, _disk(reach_m / self.cell_m))
            self._grown[reach_m] = grown
        column = np.floor((local[:, 0] + self.width_m / 2) / self.cell_m).astype(int) + margin
        row = np.floor((self.height_m / 2 - local[:, 2]) / self.cell_m).astype(int) + margin
        height, width = grown.shape
        inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
        return np.asarray(inside & (grown[np.where(inside, row, 0), np.where(inside, column, 0)] > 0))


def find_planes(surface: SceneSurface, camera_centres_world: Points) -> tuple[PlaneRegion, ...]:
    """All vertical flat regions, largest first. Deterministic and independent of any click."""
    params = tuned(Params)
    centres, normals, areas = _vertical_faces(surface)
    if len(centres) < 50:
        return ()
    regions = _regions(centres, normals, areas)
    # A small plane a few centimetres off a large one shares its peak and is cut off: look once more at what is left.
    rest = np.ones(len(centres), bool)
    for region in regions:
        off = np.abs((centres - region.world_from_plane.translation) @ region.outward)
        rest &= ~((off < 0.015) & (normals @ region.outward > params.normal_cos) & region.supports(centres, 0.02))
    if rest.sum() > 50:
        regions += _regions(centres[rest], normals[rest], areas[rest])
    regions = [region for region in regions if _faces_cameras(region, camera_centres_world)]
    return tuple(_without_twins(sorted(regions, key=lambda region: -region.area_m2)))


def _regions(centres: Points, normals: Points, areas: np.ndarray) -> list[PlaneRegion]:
    params = tuned(Params)
    regions: list[PlaneRegion] = []
    for yaw in _dominant_yaws(normals, areas):
        outward = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        aligned = normals @ outward > params.normal_cos
        for offset in _peaks(centres[aligned] @ outward, areas[aligned]):
            member = aligned & (np.abs(centres @ outward - offset) < params.thickness_m)
            regions += _split(centres[member], areas[member], outward)
    return regions


def region_at(regions: tuple[PlaneRegion, ...], point_world: Vector3, reach_m: float = 0.06) -> PlaneRegion | None:
    """The region that a world point lies on; of several, the nearest plane, larger ones first by a small margin."""
    return next(iter(regions_at(regions, point_world, reach_m)), None)


def regions_at(regions: tuple[PlaneRegion, ...], point_world: Vector3, reach_m: float = 0.06) -> list[PlaneRegion]:
    """The regions that a world point may lie on, the likeliest first."""
    found: list[tuple[float, PlaneRegion]] = []
    for region in regions:
        distance = abs(float(region.world_from_plane.inverse.apply(point_world[None])[0, 1]))
        if distance <= reach_m and region.supports(point_world[None], reach_m)[0]:
            found.append((distance - 0.01 * min(region.area_m2, 1.0), region))  # centimetre noise must not prefer a sliver
    return [region for _, region in sorted(found, key=lambda pair: pair[0])]


def region_along(
    regions: tuple[PlaneRegion, ...], origin_world: Vector3, ray_world: Vector3, farthest_m: float, reach_m: float
) -> tuple[PlaneRegion, Vector3] | None:
    """The region whose plane a ray meets nearest to the region's seen part, and where: for surfaces without depth.

    `farthest_m` bounds the distance along the ray, `reach_m` how far from the seen part it may pass.
    """
    best: tuple[float, PlaneRegion, Vector3] | None = None
    for region in regions:
        slope = float(ray_world @ region.outward)
        if slope > -0.15:
            continue
        distance = float((region.world_from_plane.translation - origin_world) @ region.outward) / slope
        if not 0.2 < distance < farthest_m:
            continue
        point = origin_world + distance * ray_world
        away = next(
            (step for step in np.arange(0.0, reach_m + 0.02, 0.03) if region.supports(point[None], float(step))[0]), None
        )
        if away is None:
            continue
        score = float(away) + 0.05 * distance
        if best is None or score < best[0]:
            best = (score, region, point)
    return (best[1], best[2]) if best else None


def _vertical_faces(surface: SceneSurface) -> tuple[Points, Points, np.ndarray]:
    centres, normals, areas = face_normals(surface.vertices_world, surface.faces)
    vertical = np.abs(normals[:, 2]) < 0.3
    flat = normals[vertical] * [1, 1, 0]
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    return centres[vertical], flat, areas[vertical]


def _dominant_yaws(normals: Points, areas: np.ndarray) -> list[float]:
    """Peaks of the area histogram over yaw."""
    params = tuned(Params)
    yaw = np.arctan2(normals[:, 1], normals[:, 0]) % (2 * np.pi)
    bins = np.bincount((yaw / (2 * np.pi) * params.yaw_bins).astype(int) % params.yaw_bins, areas, params.yaw_bins)
    smooth = ndimage.gaussian_filter1d(bins, 3.0, mode="wrap")
    peaks = [i for i in range(params.yaw_bins) if smooth[i] == smooth[np.arange(i - 8, i + 9) % params.yaw_bins].max()]
    enough = max(0.02 * smooth.max(), 1e-4)
    return [(i + 0.5) / params.yaw_bins * 2 * np.pi for i in sorted(peaks, key=lambda i: -smooth[i]) if smooth[i] > enough][:12]


def _peaks(offsets: np.ndarray, areas: np.ndarray) -> list[float]:
    """Offsets along a normal where area piles up, at least 3 cm apart."""
    params = tuned(Params)
    if len(offsets) == 0:
        return []
    low = offsets.min() - 0.05
    bins = np.bincount(((offsets - low) / params.offset_bin_m).astype(int), areas)
    smooth = ndimage.gaussian_filter1d(np.pad(bins, 12), 2.0)
    radius = round(0.03 / params.offset_bin_m)
    highest = ndimage.maximum_filter1d(smooth, 2 * radius + 1)
    peaks = np.flatnonzero((smooth == highest) & (smooth > 0.004))
    return [low + (i - 12 + 0.5) * params.offset_bin_m for i in peaks]


def _split(centres: Points, areas: np.ndarray, outward: Vector3) -> list[PlaneRegion]:
    """Connected parts of one plane."""
    params = tuned(Params)
    rotation = front_rotation(outward)
    u, z = centres @ rotation[:, 0], centres[:, 2]
    u0, z0 = u.min() - 2 * params.cell_m, z.min() - 2 * params.cell_m
    column, row = ((u - u0) / params.cell_m).astype(int), ((z - z0) / params.cell_m).astype(int)
    occupied = np.zeros((row.max() + 3, column.max() + 3), np.uint8)
    occupied[row, column] = 1
    bridged = cv2.morphologyEx(np.pad(occupied, 8), cv2.MORPH_CLOSE, _disk(params.bridge_m / params.cell_m / 2))[8:-8, 8:-8]
    count, labels = cv2.connectedComponents(bridged, connectivity=4)
    regions = []
    for label in range(1, count):
        member = labels[row, column] == label
        if areas[member].sum() > params.smallest_m2:
            regions.append(_region(centres[member], areas[member], outward))
    return regions


def _region(centres: Points, areas: np.ndarray, outward: Vector3) -> PlaneRegion:
    params = tuned(Params)
    normal, anchor = _fit(centres, areas, outward)
    rotation = front_rotation(normal)
    local = (centres - anchor) @ rotation
    near = np.abs(local[:, 1]) < params.thickness_m
    if near.sum() < 10:
        near[:] = True
    low, high = local[near][:, [0, 2]].min(axis=0), local[near][:, [0, 2]].max(axis=0)
    low, high = np.floor(low / params.cell_m) * params.cell_m, np.ceil(high / params.cell_m) * params.cell_m
    width, height = high - low
    middle = anchor + rotation @ np.array([(low + high)[0] / 2, 0.0, (low + high)[1] / 2])
    shape = (round(height / params.cell_m), round(width / params.cell_m))
    support = np.zeros(shape, bool)
    row = ((high[1] - local[near, 2]) / params.cell_m).astype(int).clip(0, shape[0] - 1)
    column = ((local[near, 0] - low[0]) / params.cell_m).astype(int).clip(0, shape[1] - 1)
    support[row, column] = True
    return PlaneRegion(Rigid3(rotation, middle), float(width), float(height), support, params.cell_m, float(areas[near].sum()))


def _fit(centres: Points, areas: np.ndarray, outward: Vector3) -> tuple[Vector3, Vector3]:
    """Trimmed total least squares in plan: a vertical plane's normal and a point on it."""
    weights = areas.copy()
    plan = centres[:, :2]
    normal = outward[:2]
    for _ in range(4):
        middle = np.average(plan, axis=0, weights=weights)
        spread = plan - middle
        _, vectors = np.linalg.eigh((spread * weights[:, None]).T @ spread)
        normal = vectors[:, 0] * np.sign(vectors[:, 0] @ outward[:2])
        if normal @ outward[:2] < np.cos(np.radians(12)):  # too narrow a sliver to measure its yaw
            normal = outward[:2]
        distance = np.abs(spread @ normal)
        weights = areas / (1 + (distance / 0.008) ** 2)
    middle = np.average(plan, axis=0, weights=weights)
    return np.array([normal[0], normal[1], 0.0]), np.array([middle[0], middle[1], centres[:, 2].mean()])


def _faces_cameras(region: PlaneRegion, camera_centres_world: Points) -> bool:
    return bool(((camera_centres_world - region.world_from_plane.translation) @ region.outward > 0.1).any())


def _without_twins(regions: list[PlaneRegion]) -> list[PlaneRegion]:
    """Drop regions that a larger one already covers (neighbouring yaw peaks find the same run)."""
    params = tuned(Params)
    kept: list[PlaneRegion] = []
    for region in regions:
        points = region.points
        twin = False
        for other in kept:
            if other.outward @ region.outward < np.cos(np.radians(25)):
                continue
            local = other.world_from_plane.inverse.apply(points)
            inside = other.supports(points, 0.02) & (np.abs(local[:, 1]) < 0.8 * params.thickness_m)
            twin = twin or bool(inside.mean() > 0.6)
        if not twin:
            kept.append(region)
    return kept


def _disk(radius: float) -> np.ndarray:
    size = 2 * max(1, round(radius)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
