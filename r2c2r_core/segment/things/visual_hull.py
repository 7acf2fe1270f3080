"""Visual hull of small objects, carved by depth (free space), then by colour silhouettes, which tolerate coarse depth."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.camera import project, sample_nearest, unproject
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.cylinder import Params as CylinderParams
from r2c2r_core.segment.things.cylinder import upright_shape
from r2c2r_core.segment.things.silhouettes import colours_of, crop_outline, usual_shift
from r2c2r_core.segment.things.support import pose_spread, raised, support_offset
from r2c2r_core.segment.things.thing import Params as ThingParams
from r2c2r_core.segment.things.thing import Thing, ThingConfig, support_height
from r2c2r_core.segment.things.voxels import Voxels, cropped, grown, label_near, mesh_of, part_at, with_headroom
from r2c2r_core.segment.viewpoints import best_views
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the visual hull."""

    frames: int = param(18, "count", "Maximum number of frames that carve", ge=1)
    glimpse_frames: int = param(6, "count", "Maximum number of frames that carve the preview", ge=1)
    voxels: int = param(100_000, "count", "Number of voxels of the grid", ge=1000)
    glimpse_voxels: int = param(25_000, "count", "Number of voxels of the preview grid", ge=1000)
    pose_share: float = param(
        0.08,
        "share",
        "Maximum pose error between frames as a fraction of the object's width: carving removes as much on either side",
    )
    near_support_m: float = param(
        0.05, "m", "Margin around the grid for depth points", source="more than a frame's height offset"
    )
    off_support_m: float = param(0.012, "m", "Maximum height above the support of points that belong to the support")
    depth_slack_m: float = param(0.022, "m", "Error of coarse depth on a curved object, along the line of sight")
    carved_m: float = param(
        0.010,
        "m",
        "Minimum distance of depth behind a voxel, beyond the noise, to see through it: depth cells mix object and background",
        source="ten bottles of the sample kitchens and of a second generator: mean IoU 0.92, against 0.91 with a fixed 22 mm",
    )
    hidden_m: float = param(0.13, "m", "Minimum distance of depth in front of a voxel, beyond the noise, to hide it")
    seen_through: float = param(0.12, "share", "Maximum fraction of views that may see through a solid voxel by error")
    seen_share: float = param(0.05, "share", "Minimum fraction of views that must hit a cell where poses agree")
    agreed_share: float = param(0.35, "share", "Minimum fraction of views that must hit a cell where each view smears it")
    inside: float = param(0.85, "share", "Minimum fraction of silhouettes that must contain a voxel", gt=0, lt=1)


def find_small(
    scene: Scene, positives: Points, negatives: Points, config: ThingConfig, structure: tuple[PlaneRegion, ...]
) -> Thing | None:
    """Visual hull of a small object; None where depth shows no separate object at the clicks."""
    params = tuned(Params)
    support = support_height(scene, positives, config)
    voxels = _voxels_around(scene, positives, config, support, params.voxels)
    views = best_views(scene, positives.mean(axis=0), params.frames)
    if len(views) < 2:
        return None
    spread = _pose_spread(scene, views, support, positives.mean(axis=0))
    borne = params.pose_share * (config.width_m or config.radius_m)
    if spread > borne:
        return _loose(scene, positives, views, config, voxels, support, structure)
    solid = _depth_hull(scene, views, voxels, positives, negatives, support, structure)
    if solid is None:
        return None
    fine, solid = cropped(voxels, solid)
    room = with_headroom(solid, fine)
    thing = mesh_of(solid.astype(np.float32), 0.5, fine, support)
    if thing is None:
        return None
    for band_m in (0.012, 0.007):  # the first silhouettes start from coarse depth, the second from the first
        thing = replace(thing, colours=colours_of(thing, scene, views, band_m))
        share = np.where(room, _silhouette_share(thing, fine, scene, views, band_m), 0)
        inside = part_at(share > params.inside, fine, positives, negatives, reach_m=0.03)
        better = mesh_of(np.where(grown(inside), share, 0), params.inside, fine, support) if inside is not None else None
        if better is None:
            break
        thing = replace(better, colours=thing.colours)
    if spread + usual_shift(thing, scene, views) > borne or _too_wide(thing, config) or _lost(thing, scene, views, positives):
        return _loose(scene, positives, views, config, voxels, support, structure)
    return thing


def glimpse_small(
    scene: Scene, positives: Points, negatives: Points, config: ThingConfig, structure: tuple[PlaneRegion, ...]
) -> Thing | None:
    """Preview hull from the depth of a few frames alone, fast enough for a click."""
    params = tuned(Params)
    support = support_height(scene, positives, config)
    views = best_views(scene, positives.mean(axis=0), params.glimpse_frames)[: params.glimpse_frames]
    if len(views) < 2:
        return None
    voxels = _voxels_around(scene, positives, config, support, params.glimpse_voxels)
    solid = _depth_hull(scene, views, voxels, positives, negatives, support, structure)
    return mesh_of(solid.astype(np.float32), 0.5, voxels, support) if solid is not None else None


def _depth_hull(
    scene: Scene,
    views: list[Frame],
    voxels: Voxels,
    positives: Points,
    negatives: Points,
    support: float | None,
    structure: tuple[PlaneRegion, ...],
) -> np.ndarray | None:
    """Solid that depth leaves at the clicks; None where it shows no separate object."""
    front = _seen_points(scene, views, voxels, positives, support, structure, tuned(Params).seen_share)
    if len(front) < 12:
        return None
    solid = _carve(voxels, scene, views, support) & _as_deep_as_wide(voxels, front, views)
    return part_at(solid, voxels, positives, negatives, reach_m=0.03)


def _loose(
    scene: Scene,
    positives: Points,
    views: list[Frame],
    config: ThingConfig,
    voxels: Voxels,
    support: float | None,
    structure: tuple[PlaneRegion, ...],
) -> Thing | None:
    """Rough shape where frame poses disagree: a cylinder for round objects, else the depth points, filled downwards."""
    front = _seen_points(scene, views, voxels, positives, support, structure, tuned(Params).agreed_share)
    if config.round or len(front) < 12:
        return upright_shape(scene, positives, views, config, support)
    at = np.floor((front - voxels.origin) / voxels.size_m).astype(int).clip(0, np.array(voxels.shape) - 1)
    solid = np.zeros(voxels.shape, bool)
    solid[at[:, 0], at[:, 1], at[:, 2]] = True
    solid = np.maximum.accumulate(solid[:, :, ::-1], axis=2)[:, :, ::-1] if support is not None else solid
    thing = mesh_of(_closed(solid).astype(np.float32), 0.5, voxels, support)
    if thing is None:
        return None
    thing = replace(thing, pose_error_m=tuned(CylinderParams).wanders_m, border_m=0.012)
    for _ in range(2):
        thing = replace(thing, colours=colours_of(thing, scene, views, 0.015))
    return thing


def _closed(solid: np.ndarray) -> np.ndarray:
    """Voxels with gaps of a depth cell closed, level by level."""
    from scipy import ndimage

    padded = np.pad(solid, ((4, 4), (4, 4), (0, 0)))
    return np.asarray(ndimage.binary_closing(padded, structure=np.ones((3, 3, 1)), iterations=3)[4:-4, 4:-4])


def _too_wide(thing: Thing, config: ThingConfig) -> bool:
    """Whether the hull is far wider than its category allows, having absorbed a neighbour."""
    width = np.ptp(np.quantile(thing.vertices[:, :2], [0.02, 0.98], axis=0), axis=0).min()
    return config.width_m is not None and bool(width > 1.7 * config.width_m)


def _lost(thing: Thing, scene: Scene, views: list[Frame], positives: Points) -> bool:
    """Whether the hull misses a click, or shows in too few of the frames that see the clicks."""
    away = [_from_hull(thing, point, views) for point in positives]
    shown = [bool(crop_outline(thing, scene, frame)[1].any()) for frame in views[::2]]
    return max(away) > 0.02 or float(np.mean(shown)) < 0.7


def _from_hull(thing: Thing, click: Vector3, views: list[Frame]) -> float:
    """Distance of a clicked point from the hull, metres, with slack along the line of sight for coarse depth."""
    sight = click - np.mean([frame.world_from_camera.translation for frame in views], axis=0)
    sight /= max(float(np.linalg.norm(sight)), 1e-6)
    offset = thing.vertices - click
    along = offset @ sight
    across = np.linalg.norm(offset - along[:, None] * sight, axis=1)
    return float(np.hypot(across, np.maximum(np.abs(along) - tuned(Params).depth_slack_m, 0)).min())


def _pose_spread(scene: Scene, views: list[Frame], support: float | None, centre: Vector3) -> float:
    """Median absolute deviation of the frames' height offsets at the support."""
    return pose_spread([support_offset(scene, frame, support, centre) for frame in views])


def _voxels_around(scene: Scene, positives: Points, config: ThingConfig, support: float | None, count: int) -> Voxels:
    reach = 1.25 * config.radius_m + 0.02
    low, high = positives.min(axis=0) - reach, positives.max(axis=0) + reach
    low[2], high[2] = positives[:, 2].min() - 2.2 * config.radius_m, positives[:, 2].max() + 2.2 * config.radius_m
    if support is not None:
        low[2] = support + 0.002
        high[2] = max(min(high[2], support + 2.6 * config.radius_m), positives[:, 2].max() + 0.03)
    # The clicks lie on the near side: look further behind them than before them.
    centres = np.stack([frame.world_from_camera.translation for frame in scene.frames])
    away = positives.mean(axis=0) - centres[np.argmin(np.linalg.norm(centres - positives.mean(axis=0), axis=1))]
    away[2] = 0
    low, high = (
        low + 0.3 * reach * away / max(np.linalg.norm(away), 1e-6),
        high + 0.3 * reach * away / max(np.linalg.norm(away), 1e-6),
    )
    size = max(0.003, float(np.prod(high - low) / count) ** (1 / 3))
    return Voxels(low, size, tuple(np.ceil((high - low) / size).astype(int).tolist()))


def _carve(voxels: Voxels, scene: Scene, views: list[Frame], support: float | None) -> np.ndarray:
    """Voxels that depth does not show to be empty, and that at least one frame's depth reaches without being occluded."""
    params = tuned(Params)
    centres = voxels.centres
    empty, known = np.zeros(len(centres), np.int32), np.zeros(len(centres), np.int32)
    for frame in views:
        depth = scene.depth(frame.index)
        offset = support_offset(scene, frame, support, centres.mean(axis=0))
        z, seen, _ = look_up(raised(centres, offset), frame.world_from_camera, frame.depth_camera, depth)
        empty += scene.noise.seen_through(seen, z, params.carved_m)
        known += (seen > 0) & ~scene.noise.occluded(seen, z, params.hidden_m)
    return np.asarray((empty <= np.maximum(1, params.seen_through * known)) & (known > 0)).reshape(voxels.shape)


def _seen_points(
    scene: Scene,
    views: list[Frame],
    voxels: Voxels,
    positives: Points,
    support: float | None,
    structure: tuple[PlaneRegion, ...],
    share: float,
) -> Points:
    """Depth points of the object seen in a `share` of the views: connected to the clicks, off its support and off walls."""
    params = tuned(Params)
    from scipy import ndimage

    cell = max(voxels.size_m, 0.008)
    extent = np.array(voxels.shape) * voxels.size_m
    shape = np.ceil(extent / cell).astype(int)
    low, high = voxels.origin - params.near_support_m, voxels.origin + shape * cell + params.near_support_m
    hits = np.zeros(shape, np.int32)
    for frame in views:
        points = frame.world_from_camera.apply(_depth_points_near(scene, frame, low, high))
        points = raised(points, -support_offset(scene, frame, support, positives.mean(axis=0)))
        at = np.floor((points - voxels.origin) / cell).astype(int)
        at[:, 2] = np.where(points[:, 2] < voxels.origin[2] + params.off_support_m, -1, at[:, 2])
        inside = ((at >= 0) & (at < shape)).all(axis=1)
        points, at = points[inside], at[inside]
        for plane in structure:
            off = np.abs((points - plane.world_from_plane.translation) @ plane.outward) > tuned(ThingParams).off_wall_m
            off |= ~plane.supports(points, 0.10)
            points, at = points[off], at[off]
        once = np.unique(at @ [shape[1] * shape[2], shape[2], 1])
        hits.ravel()[once] += 1
    solid = hits >= max(2, share * len(views))
    labels, _ = ndimage.label(solid, structure=np.ones((3, 3, 3)))
    grid = Voxels(voxels.origin, cell, tuple(shape.tolist()))
    chosen = {label for point in positives if (label := label_near(labels, grid, point, 0.035))}
    return (np.argwhere(np.isin(labels, sorted(chosen))) + 0.5) * cell + voxels.origin if chosen else np.zeros((0, 3))


def _depth_points_near(scene: Scene, frame: Frame, low: Vector3, high: Vector3) -> Points:
    """Camera-frame points of the depth pixels in the image rectangle of a world box."""
    depth, camera = scene.depth(frame.index), frame.depth_camera
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
    local = frame.world_from_camera.inverse.apply(corners)
    left, top, right, bottom = 0, 0, camera.width, camera.height
    if local[:, 2].min() > 0.05:
        uv = project(local, camera)
        left, top = np.clip(np.floor(uv.min(axis=0)), 0, [right, bottom]).astype(int)
        right, bottom = np.clip(np.ceil(uv.max(axis=0)), 0, [right, bottom]).astype(int)
    row, column = np.nonzero(depth[top:bottom, left:right] > 0)
    row, column = row + top, column + left
    return unproject(np.stack([column + 0.5, row + 0.5], axis=1), depth[row, column].astype(np.float64), camera)


def _as_deep_as_wide(voxels: Voxels, front: Points, views: list[Frame]) -> np.ndarray:
    """Mask of the voxels behind the seen surface, no deeper than it is wide: depth does not carve an object's shadow."""
    centres = np.stack([frame.world_from_camera.translation for frame in views])
    away = front.mean(axis=0) - centres.mean(axis=0)
    away = away * [1, 1, 0] / max(float(np.linalg.norm(away[:2])), 1e-6)
    across = np.array([-away[1], away[0], 0.0])
    low, high = np.quantile(front @ across, [0.01, 0.99])
    near, far = np.quantile(front @ away, [0.01, 0.99])
    slack = 0.012
    far = max(far, near + (high - low))
    at = voxels.centres
    side, deep = at @ across, at @ away
    inside = (side > low - slack) & (side < high + slack) & (deep > near - slack) & (deep < far + slack)
    inside &= at[:, 2] < np.quantile(front[:, 2], 0.995) + 0.03
    return np.asarray(inside.reshape(voxels.shape))


def _silhouette_share(thing: Thing, voxels: Voxels, scene: Scene, views: list[Frame], band_m: float) -> np.ndarray:
    """Fraction of the colour silhouettes that contain each voxel, among the views that could show it."""
    centres = voxels.centres
    inside, seen = np.zeros(len(centres)), np.zeros(len(centres))
    for frame in views:
        crop, mask, _ = crop_outline(thing, scene, frame, band_m)
        if crop is None or not mask.any():
            continue
        offset = support_offset(scene, frame, thing.support_z_m, thing.vertices.mean(axis=0))
        local = frame.world_from_camera.inverse.apply(raised(centres, offset))
        uv = project(local, crop.camera)
        outlined, in_crop = sample_nearest(mask, uv)
        hidden, _ = sample_nearest(crop.hidden, uv)
        in_mask = outlined & in_crop
        _, valid = sample_nearest(scene.rgb(frame.index), project(local, frame.rgb_camera))
        valid &= ~(hidden & in_crop) | in_mask
        seen += valid
        inside += valid & in_mask
    share = inside / np.maximum(seen, 1)
    share[seen < 2] = 0
    return share.reshape(voxels.shape).astype(np.float32)
