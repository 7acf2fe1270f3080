"""Vertical planes of the fused surface by Hough voting over yaw and offset: fronts of furniture runs, before any click."""

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from scipy import ndimage

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.model.capture import SceneSurface
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.segment.surface import face_normals
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the plane search."""

    cell_m: float = param(0.02, "m", "Cell size of the support map", gt=0)
    normal_cos: float = param(
        float(np.cos(np.radians(22))),
        "cosine",
        "Minimum cosine between a face's normal and its plane's: 22 degrees",
        source="TSDF normals of noisy scans scatter",
    )
    yaw_bins: int = param(360, "count", "Number of yaw bins in a full turn", ge=36)
    offset_bin_m: float = param(0.005, "m", "Bin size of the offset histogram", gt=0)
    thickness_m: float = param(0.025, "m", "Maximum distance from a plane of points that belong to it")
    bridge_m: float = param(0.10, "m", "Maximum width of holes, left by occluders, that are bridged in a run")
    adjoins_m: float = param(0.04, "m", "Maximum gap across which adjoining surface on the fitted plane joins a region")
    vertical_cos: float = param(0.3, "cosine", "Maximum absolute cosine between a normal and up for a face of a vertical plane")
    smooth_bins: tuple[float, float] = param(
        (3.0, 2.0), "count", "Standard deviation, in bins, of the smoothing of the yaw and offset histograms"
    )
    yaw_share: float = param(0.02, "share", "Minimum area at a yaw peak as a fraction of the strongest peak's")
    scatter_deg: float = param(6.0, "deg", "Angle from a yaw peak at which a face's weight in its mean halves", gt=0)
    yaws: int = param(12, "count", "Maximum number of yaws searched", ge=1)
    apart_m: float = param(0.03, "m", "Minimum distance between parallel planes")
    peak_m2: float = param(0.004, "m²", "Minimum smoothed area in an offset bin for a plane")
    fit_m: float = param(0.004, "m", "Distance from a plane at which a face's weight in its fit halves")
    fit_deg: float = param(
        12.0, "deg", "Maximum rotation of a fit from its yaw peak: a narrow sliver does not determine its yaw"
    )
    face_bin_m: float = param(0.0025, "m", "Bin size of offsets in the search for the outermost face", gt=0)
    face_line_m: float = param(0.1, "m", "Width of the rows and columns in that search", gt=0)
    face_share: float = param(
        0.01, "share", "Minimum fraction of a row's or column's area in a face's offset bin for the face to go through it"
    )
    face_through: float = param(
        0.8, "share", "Minimum fraction of rows, and of columns, that a face must go through", gt=0, le=1
    )
    left_m: float = param(
        0.015, "m", "Maximum distance from a plane of faces that belong to it: the others are searched once more"
    )
    beside_m: float = param(0.02, "m", "Maximum distance, in the plane, from the observed part of faces that belong to it")
    twin_deg: float = param(25.0, "deg", "Maximum angle between duplicate planes: neighbouring yaws find the same run")
    twin_share: float = param(0.6, "share", "Minimum fraction of a plane covered by a larger one for it to be a duplicate")
    sunk_m: float = param(
        0.035,
        "m",
        "Maximum distance of a panel behind its frame's plane",
        gt=0,
        source="boards of 16-22 mm with 10 mm of panel behind",
    )
    rim_m: tuple[float, float] = param(
        (0.02, 0.045),
        "m",
        "Inner and outer distance from a panel of the rim tested for its frame: depth blurs, stiles are 5 cm wide and more",
    )
    rim_share: float = param(0.85, "share", "Minimum fraction of that rim, on each side, in the frame's plane", gt=0, le=1)
    grazing_cos: float = param(0.15, "cosine", "Minimum cosine between a ray and a plane's inward normal for an intersection")
    large_m: float = param(
        0.01, "m", "Reduction of a plane's distance from a click per square metre: noise must prefer no sliver"
    )
    smallest_m2: float = param(
        0.015, "m²", "Minimum area of a plane", source="the keypad of a microwave whose glass gives no depth"
    )


@dataclass(frozen=True, slots=True, eq=False)
class PlaneRegion:
    """One connected flat vertical part of the scan; `world_from_plane` is a `front` frame at its centre."""

    world_from_plane: Rigid3
    width_m: float
    height_m: float
    support: np.ndarray  # bool, row 0 at the top, cells of `cell_m`
    cell_m: float
    area_m2: float
    _grown: dict[float, np.ndarray] = field(default_factory=dict, init=False, repr=False)  # by reach: clicks use the same few

    @property
    def outward(self) -> Vector3:
        """Unit normal, towards the room."""
        return -self.world_from_plane.rotation[:, 1]

    @property
    def points(self) -> Points:
        """World points (n, 3) of the observed cells."""
        row, column = np.nonzero(self.support)
        x = (column + 0.5) * self.cell_m - self.width_m / 2
        z = self.height_m / 2 - (row + 0.5) * self.cell_m
        return self.world_from_plane.apply(np.stack([x, np.zeros(len(x)), z], axis=1))

    @property
    def bounds(self) -> Rectangle3:
        """Rectangle around the observed part."""
        return Rectangle3(world_from_front=self.world_from_plane, width_m=self.width_m, height_m=self.height_m)

    def supports(self, points_world: Points, reach_m: float) -> np.ndarray:
        """Mask of the points (n, 3) within `reach_m` of the observed part, measured in the plane."""
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
    # A small plane a few centimetres off a large one shares its peak and is cut off: search the remaining faces once more.
    rest = np.ones(len(centres), bool)
    for region in regions:
        off = np.abs((centres - region.world_from_plane.translation) @ region.outward)
        rest &= ~(
            (off < params.left_m) & (normals @ region.outward > params.normal_cos) & region.supports(centres, params.beside_m)
        )
    if rest.sum() > 50:
        regions += _regions(centres[rest], normals[rest], areas[rest])
    regions = [region for region in regions if _faces_cameras(region, camera_centres_world)]
    apart = _with_panels(_without_twins(_largest_first(regions)))
    return tuple(_without_twins(_largest_first([_regrown(region, centres, normals, areas) for region in apart])))


def _largest_first(regions: list[PlaneRegion]) -> list[PlaneRegion]:
    return sorted(regions, key=lambda region: -region.area_m2)


def _regions(centres: Points, normals: Points, areas: np.ndarray) -> list[PlaneRegion]:
    params = tuned(Params)
    regions: list[PlaneRegion] = []
    for yaw in _dominant_yaws(normals, areas):
        outward = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        aligned = normals @ outward > params.normal_cos
        for offset in _peaks(centres[aligned] @ outward, areas[aligned]):
            member = aligned & (np.abs(centres @ outward - offset) < params.thickness_m)
            regions += _split(centres[member], areas[member], outward, offset, params.bridge_m)
    return regions


def _regrown(region: PlaneRegion, centres: Points, normals: Points, areas: np.ndarray) -> PlaneRegion:
    """Region extended by adjoining surface on its fitted plane: over a long run, half a yaw bin exceeds its thickness."""
    params, seen = tuned(Params), region.points
    off = np.abs((centres - region.world_from_plane.translation) @ region.outward)
    near = np.flatnonzero((off < params.thickness_m) & (normals @ region.outward > params.normal_cos))
    member = near[(off[near] < params.left_m) | region.supports(centres[near], 0.0)]
    offset = float(region.world_from_plane.translation @ region.outward)
    parts = _split(centres[member], areas[member], region.outward, offset, params.adjoins_m)
    if not parts:
        return region
    grown = max(parts, key=lambda part: part.supports(seen, params.beside_m).mean())
    return replace(_filled(grown, region), area_m2=max(grown.area_m2, region.area_m2))


def region_at(regions: tuple[PlaneRegion, ...], point_world: Vector3, reach_m: float = 0.06) -> PlaneRegion | None:
    """Region that a world point lies on; of several, the nearest plane, larger ones first by a small margin."""
    return next(iter(regions_at(regions, point_world, reach_m)), None)


def regions_at(
    regions: tuple[PlaneRegion, ...], point_world: Vector3, reach_m: float = 0.06, beside_m: float | None = None
) -> list[PlaneRegion]:
    """Regions that a world point may lie on, the likeliest first.

    The point lies within `reach_m` of the plane, and within `beside_m` (by default as much) of its observed part.
    """
    beside_m = reach_m if beside_m is None else beside_m
    found: list[tuple[float, PlaneRegion]] = []
    for region in regions:
        distance = abs(float(region.world_from_plane.inverse.apply(point_world[None])[0, 1]))
        if distance <= reach_m and region.supports(point_world[None], beside_m)[0]:
            found.append(
                (distance - tuned(Params).large_m * min(region.area_m2, 1.0), region)
            )  # centimetre noise must not prefer a sliver
    return [region for _, region in sorted(found, key=lambda pair: pair[0])]


def region_along(
    regions: tuple[PlaneRegion, ...], origin_world: Vector3, ray_world: Vector3, farthest_m: float, reach_m: float
) -> tuple[PlaneRegion, Vector3] | None:
    """Region whose plane a ray meets nearest to the region's observed part, and the intersection: for surfaces without depth.

    `farthest_m` bounds the distance along the ray, `reach_m` that from the observed part.
    """
    best: tuple[float, PlaneRegion, Vector3] | None = None
    for region in regions:
        slope = float(ray_world @ region.outward)
        if slope > -tuned(Params).grazing_cos:
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
    vertical = np.abs(normals[:, 2]) < tuned(Params).vertical_cos
    flat = normals[vertical] * [1, 1, 0]
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    return centres[vertical], flat, areas[vertical]


def _dominant_yaws(normals: Points, areas: np.ndarray) -> list[float]:
    """Peaks of the area histogram over yaw, each as the mean of the faces around it."""
    params = tuned(Params)
    yaw = np.arctan2(normals[:, 1], normals[:, 0]) % (2 * np.pi)
    bins = np.bincount((yaw / (2 * np.pi) * params.yaw_bins).astype(int) % params.yaw_bins, areas, params.yaw_bins)
    smooth = ndimage.gaussian_filter1d(bins, params.smooth_bins[0], mode="wrap")
    peaks = [i for i in range(params.yaw_bins) if smooth[i] == smooth[np.arange(i - 8, i + 9) % params.yaw_bins].max()]
    enough = max(params.yaw_share * smooth.max(), 1e-4)
    strong = sorted((i for i in peaks if smooth[i] > enough), key=lambda i: -smooth[i])
    return [_mean_yaw((i + 0.5) / params.yaw_bins * 2 * np.pi, yaw, areas) for i in strong[: params.yaws]]


def _mean_yaw(yaw: float, yaws: np.ndarray, areas: np.ndarray) -> float:
    """Mean yaw of the faces around a peak, with Welsch weights: half a degree smears planes 2 cm apart into one."""
    width = np.radians(tuned(Params).scatter_deg)
    for _ in range(4):
        off = (yaws - yaw + np.pi) % (2 * np.pi) - np.pi
        weights = areas * np.exp2(-((off / width) ** 2))
        yaw += float(np.average(off, weights=weights))
    return yaw


def _peaks(offsets: np.ndarray, areas: np.ndarray) -> list[float]:
    """Offsets along a normal at which area accumulates, far enough from each other."""
    params = tuned(Params)
    if len(offsets) == 0:
        return []
    low = offsets.min() - 0.05
    bins = np.bincount(((offsets - low) / params.offset_bin_m).astype(int), areas)
    smooth = ndimage.gaussian_filter1d(np.pad(bins, 12), params.smooth_bins[1])
    radius = round(params.apart_m / params.offset_bin_m)
    highest = ndimage.maximum_filter1d(smooth, 2 * radius + 1)
    peaks = np.flatnonzero((smooth == highest) & (smooth > params.peak_m2))
    return [low + (i - 12 + 0.5) * params.offset_bin_m for i in peaks]


def _split(centres: Points, areas: np.ndarray, outward: Vector3, offset: float, bridge_m: float) -> list[PlaneRegion]:
    """Connected parts of one plane, with holes up to `bridge_m` bridged."""
    params = tuned(Params)
    rotation = front_rotation(outward)
    u, z = centres @ rotation[:, 0], centres[:, 2]
    u0, z0 = u.min() - 2 * params.cell_m, z.min() - 2 * params.cell_m
    column, row = ((u - u0) / params.cell_m).astype(int), ((z - z0) / params.cell_m).astype(int)
    occupied = np.zeros((row.max() + 3, column.max() + 3), np.uint8)
    occupied[row, column] = 1
    bridged = cv2.morphologyEx(np.pad(occupied, 8), cv2.MORPH_CLOSE, _disk(bridge_m / params.cell_m / 2))[8:-8, 8:-8]
    count, labels = cv2.connectedComponents(bridged, connectivity=4)
    regions = []
    for label in range(1, count):
        member = labels[row, column] == label
        if areas[member].sum() > params.smallest_m2:
            regions.append(_region(centres[member], areas[member], outward, offset))
    return regions


def _region(centres: Points, areas: np.ndarray, outward: Vector3, offset: float) -> PlaneRegion:
    params = tuned(Params)
    normal, anchor = _fit(centres, areas, outward, offset)
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


def _fit(centres: Points, areas: np.ndarray, outward: Vector3, offset: float) -> tuple[Vector3, Vector3]:
    """M-estimate in plan, with Welsch weights: a vertical plane's normal and a point on it.

    Started at the mean of all nearby faces, it would lie between a face frame and its panels, or tilt between a run and surface
    2 cm in front of a part of it.
    """
    params, plan = tuned(Params), centres[:, :2]
    normal, off = outward[:2], centres @ outward - _outer_face(centres, areas, outward, offset)
    for _ in range(4):
        weights = areas * np.maximum(np.exp2(-((off / params.fit_m) ** 2)), 1e-9)
        middle = np.average(plan, axis=0, weights=weights)
        spread = plan - middle
        _, vectors = np.linalg.eigh((spread * weights[:, None]).T @ spread)
        normal = vectors[:, 0] * np.sign(vectors[:, 0] @ outward[:2])
        if normal @ outward[:2] < np.cos(np.radians(params.fit_deg)):  # too narrow a sliver to measure its yaw
            normal = outward[:2]
        off = spread @ normal
    return np.array([normal[0], normal[1], 0.0]), np.array([middle[0], middle[1], centres[:, 2].mean()])


def _outer_face(centres: Points, areas: np.ndarray, outward: Vector3, offset: float) -> float:
    """Offset of the outermost of the parallel faces near a plane that go through most of its rows and columns.

    Stiles and rails of a frame do; a worktop's edge is in few rows, a refrigerator in few columns. Of adjacent faces, the
    largest counts.
    """
    params = tuned(Params)
    off = centres @ outward - offset
    near = np.abs(off) < params.thickness_m
    if near.sum() < 10:
        return offset
    bins = int(2 * params.thickness_m / params.face_bin_m)
    at = ((off[near] + params.thickness_m) / params.face_bin_m).astype(int).clip(0, bins - 1)
    through = np.ones(bins)
    for along in (centres[near] @ np.array([-outward[1], outward[0], 0.0]), centres[near, 2]):
        line = ((along - along.min()) / params.face_line_m).astype(int)
        mass = np.bincount(line * bins + at, areas[near], (line.max() + 1) * bins).reshape(-1, bins)
        mass = ndimage.gaussian_filter1d(mass[mass.sum(axis=1) > 0], 1.0, axis=1)
        through = np.minimum(through, (mass > params.face_share * mass.sum(axis=1, keepdims=True)).mean(axis=0))
    total = ndimage.gaussian_filter1d(np.bincount(at, areas[near], bins), 1.0)
    peaks = np.flatnonzero((total == ndimage.maximum_filter1d(total, 3)) & (through > params.face_through))
    face = peaks[-1] if len(peaks) else np.argmax(total)
    return offset + float(face + 0.5) * params.face_bin_m - params.thickness_m


def _faces_cameras(region: PlaneRegion, camera_centres_world: Points) -> bool:
    return bool(((camera_centres_world - region.world_from_plane.translation) @ region.outward > 0.1).any())


def _without_twins(regions: list[PlaneRegion]) -> list[PlaneRegion]:
    """Regions without those that a larger one already covers (neighbouring yaw peaks find the same run)."""
    params = tuned(Params)
    kept: list[PlaneRegion] = []
    for region in regions:
        points = region.points
        twin = False
        for other in kept:
            if other.outward @ region.outward < np.cos(np.radians(params.twin_deg)):
                continue
            local = other.world_from_plane.inverse.apply(points)
            inside = other.supports(points, params.beside_m) & (np.abs(local[:, 1]) < 0.8 * params.thickness_m)
            twin = twin or bool(inside.mean() > params.twin_share)
        if not twin:
            kept.append(region)
    return kept


def _with_panels(regions: list[PlaneRegion]) -> list[PlaneRegion]:
    """Regions with the panels sunk in a frame merged into the frame's region: a click on either selects the front."""
    found = list(regions)
    for panel in reversed(regions):  # small ones first
        frame = next((other for other in found if other is not panel and _is_sunk_in(panel, other)), None)
        if frame is not None:
            found = [_filled(other, panel) if other is frame else other for other in found if other is not panel]
    return found


def _is_sunk_in(panel: PlaneRegion, frame: PlaneRegion) -> bool:
    """Whether most of a region lies a little behind another one that continues at all four sides of each of its parts."""
    params = tuned(Params)
    points, alone = panel.points, panel.support.astype(np.uint8)
    behind = frame.world_from_plane.inverse.apply(points)[:, 1]
    if frame.outward @ panel.outward < np.cos(np.radians(params.fit_deg)) or not 0 < np.median(behind) < params.sunk_m:
        return False
    alone[panel.support] = ~frame.supports(points, 0.0)
    margin = int(np.ceil(params.rim_m[1] / panel.cell_m)) + 1
    seen = np.pad(alone, margin)
    parts, _ = ndimage.label(cv2.morphologyEx(seen, cv2.MORPH_CLOSE, _disk(1)))
    parts *= seen
    framed = sum(
        (parts[box] == label).sum()
        for label, box in enumerate(ndimage.find_objects(parts), 1)
        if box is not None and _is_framed(parts == label, box, margin, panel, frame)
    )
    return bool(framed > seen.sum() / 2)


def _is_framed(part: np.ndarray, box: tuple[slice, slice], margin: int, panel: PlaneRegion, frame: PlaneRegion) -> bool:
    """Whether the frame's plane was observed on all four sides of a panel's part (`part` is padded by `margin` cells)."""
    params = tuned(Params)
    area = cv2.morphologyEx(part.astype(np.uint8), cv2.MORPH_CLOSE, _disk(margin))
    near, far = (cv2.dilate(area, _disk(reach / panel.cell_m)) for reach in params.rim_m)
    row, column = np.nonzero(far - near)
    x = (column - margin + 0.5) * panel.cell_m - panel.width_m / 2
    z = panel.height_m / 2 - (row - margin + 0.5) * panel.cell_m
    on = frame.supports(panel.world_from_plane.apply(np.stack([x, np.zeros(len(x)), z], axis=1)), params.cell_m / 2)
    rows, columns = box
    sides = (row < rows.start, row >= rows.stop, column < columns.start, column >= columns.stop)
    return all(on[side].mean() > params.rim_share if side.any() else False for side in sides)


def _filled(region: PlaneRegion, panel: PlaneRegion) -> PlaneRegion:
    """Region whose support includes that of a panel."""
    local, support = region.world_from_plane.inverse.apply(panel.points), region.support.copy()
    row = ((region.height_m / 2 - local[:, 2]) / region.cell_m).astype(int).clip(0, support.shape[0] - 1)
    column = ((local[:, 0] + region.width_m / 2) / region.cell_m).astype(int).clip(0, support.shape[1] - 1)
    support[row, column] = True
    return replace(region, support=support, area_m2=region.area_m2 + panel.area_m2)


def _disk(radius: float) -> np.ndarray:
    size = 2 * max(1, round(radius)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
