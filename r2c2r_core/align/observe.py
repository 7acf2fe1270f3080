"""What the recording says about one object: a few small views that look straight at it, and its cleaned points."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from r2c2r_core.arrays import DepthMetres, Mask, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, sample_nearest, sample_through, unproject
from r2c2r_core.geometry.masks import unpack_mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.views import MaskView, choose_views, stands_open
from r2c2r_core.model.capture import Capture, Depth, Frame
from r2c2r_core.model.track import MaskTrack

_CROWD = 40  # points looked at for each that is kept: a long recording has a million


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """One photo turned to look at the object and cut out square: a pure rotation, so exact for a pinhole."""

    frame_index: int
    camera: Intrinsics
    world_from_camera: Rigid3
    colour: np.ndarray  # (h, w, 3) float32 RGB
    mask: Mask
    inside: Mask  # the pixel lies in the photo
    depth_m: DepthMetres  # z-depth of this camera, 0 unknown
    depth_px: float  # width of one depth pixel, in pixels of this view
    signed_px: np.ndarray  # (h, w) float32, distance to the mask's outline, negative inside
    outwards: np.ndarray  # (h, w, 2) float32, unit direction away from the mask; 0 where the outline is as near on both sides
    trusted: Mask  # the nearest outline pixel is the object's own edge, not an occluder's or the photo's


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observation:
    """The evidence a placement is judged by."""

    views: tuple[View, ...]
    points_world: Points
    towards_camera: Points  # unit, per point
    noise_m: np.ndarray  # per point
    frame_index: np.ndarray  # per point, int
    centre_world: Vector3
    size_m: float  # diagonal of what is seen, by the points or by the masks at the points' distance


def observe(capture: Capture, track: MaskTrack, *, view_count: int, size_px: int, point_count: int) -> Observation:
    """Choose frames that see the object from different sides, and gather their pixels and points."""
    found = {
        frame: masked_points(frame, capture.images.depth(frame.index), unpack_mask(track.masks[frame.index]))
        for frame in choose_frames(capture, track, view_count)
    }
    frames = _in_one_state(found, track)
    points, towards, noise, seen_in = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, np.int64)]
    for frame in frames:
        points.append(frame.world_from_camera.apply(found[frame]))
        towards.append(_unit(frame.world_from_camera.translation - points[-1]))
        noise.append(depth_noise(found[frame][:, 2]))
        seen_in.append(np.full(len(points[-1]), frame.index))
    all_points = np.concatenate(points)
    keep = main_body(all_points)
    all_points = all_points[keep]
    centre = _centre(all_points, track)
    views = tuple(look_at(capture, track, frame, centre, size_px) for frame in frames)
    size = max(float(np.linalg.norm(np.ptp(all_points, axis=0))) if len(all_points) else 0.0, _silhouette_size(views, centre))
    chosen = thin_out(all_points, point_count)
    return Observation(
        views=views,
        points_world=all_points[chosen],
        towards_camera=np.concatenate(towards)[keep][chosen],
        noise_m=np.concatenate(noise)[keep][chosen],
        frame_index=np.concatenate(seen_in)[keep][chosen],
        centre_world=centre,
        size_m=size,
    )


def mask_box(view: View) -> np.ndarray:
    """Left, top, right, bottom of the mask, as tangents of the viewing angle; zeros where it is empty."""
    rows, columns = np.flatnonzero(view.mask.any(axis=1)), np.flatnonzero(view.mask.any(axis=0))
    if not len(rows):
        return np.zeros(4)
    edges = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], dtype=np.float64)
    return (edges - [view.camera.cx, view.camera.cy] * 2) / view.camera.fx


def _silhouette_size(views: tuple[View, ...], centre: Vector3) -> float:
    """Diagonal of the masks at the object's distance: dark glass returns no depth, but has an outline."""
    boxes = np.array([mask_box(v) for v in views]).reshape(-1, 4)
    distance = np.array([np.linalg.norm(v.world_from_camera.translation - centre) for v in views])
    return float(np.median(np.hypot(boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]) * distance)) if len(views) else 0.0


def depth_noise(depth_m: np.ndarray) -> np.ndarray:
    """Standard deviation to expect of a phone's depth, metres: 4 mm and 3 mm more for each metre of distance."""
    return 0.004 + 0.003 * depth_m


def choose_frames(capture: Capture, track: MaskTrack, count: int) -> tuple[Frame, ...]:
    """Up to `count` frames with large, whole, sharp masks, spread over the directions the object is seen from."""
    known = [f for f in capture.frames if f.index in track.masks]
    known = [f for f in known if f.index not in track.opened_frames] or known  # opened, its front stands elsewhere
    largest = max((track.masks[f.index].area_px for f in known), default=0)
    known = [f for f in known if track.masks[f.index].area_px >= max(48.0, 0.08 * largest)]
    if not known:
        return ()
    target = _rough_centre(capture, track, max(known, key=lambda f: track.masks[f.index].area_px))
    views = [
        MaskView(
            frame_index=frame.index,
            mask=track.masks[frame.index],
            sharpness=frame.sharpness,
            confidence=track.confidence.get(frame.index, 1.0),
            from_object=frame.world_from_camera.translation - target,
        )
        for frame in known
    ]
    chosen = {view.frame_index for view in choose_views(views, count)}
    return tuple(frame for frame in known if frame.index in chosen)


def _in_one_state(found: dict[Frame, Points], track: MaskTrack) -> tuple[Frame, ...]:
    """The frames that show a front where it was measured, not pulled or swung open; all, where none or no front does."""
    if track.front is None:
        return tuple(found)
    front_from_world = track.front.world_from_front.inverse
    closed = [
        frame
        for frame, points in found.items()
        if not stands_open(-front_from_world.apply(frame.world_from_camera.apply(points))[:, 1])
    ]
    return tuple(closed or found)


def masked_points(frame: Frame, depth: Depth, mask: Mask) -> Points:
    """Camera-frame points of the depth pixels well inside the mask; depth is used at its own resolution."""
    if not mask.any():
        return np.zeros((0, 3))
    per_depth_px = mask.shape[1] / frame.depth_camera.width
    thickness = 2.0 * float(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 3).max())
    margin = min(per_depth_px, 0.15 * thickness)  # a thin bottle must keep its middle
    inner = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1] > margin
    hit, within = sample_through(inner, frame.rgb_camera, frame.depth_camera)
    valid = hit & within & depth.valid & (depth.metres > 0)
    return unproject(pixel_centres(frame.depth_camera)[valid], depth.metres[valid].astype(np.float64), frame.depth_camera)


def main_body(points: Points) -> np.ndarray:
    """Which points belong to the object's connected body, rather than to what shows through slats or behind edges."""
    if len(points) < 30:
        return np.ones(len(points), dtype=bool)
    spread = np.quantile(points, 0.95, axis=0) - np.quantile(points, 0.05, axis=0)
    voxel = float(np.clip(np.linalg.norm(spread) / 20, 0.01, 0.04))
    _, first, member, filled = np.unique(_cell_keys(points, voxel), return_index=True, return_inverse=True, return_counts=True)
    cells = np.floor(points[first] / voxel).astype(np.int64)
    dense = filled >= 2
    label = np.full(len(cells), -1)
    label[dense], sizes = _components(cells[dense], filled[dense])
    big = np.flatnonzero(sizes >= 0.25 * sizes.max(initial=0))
    keep = np.isin(label, big)[member.ravel()]
    return keep if keep.sum() >= 0.4 * len(points) else np.ones(len(points), dtype=bool)


def thin_out(points: Points, count: int) -> np.ndarray:
    """Indices of about `count` points spread evenly: one in each cell of a grid, of no frame in particular."""
    if len(points) <= count:
        return np.arange(len(points))
    shuffled = np.random.default_rng(0).permutation(len(points))  # frames disagree by a centimetre: none may be first
    shuffled = shuffled[: _CROWD * count]
    voxel = 0.002
    while True:
        _, first = np.unique(_cell_keys(points[shuffled], voxel), return_index=True)
        if len(first) <= count:
            return np.sort(shuffled[first])
        voxel *= 1.25


def _cell_keys(points: Points, voxel: float) -> np.ndarray:
    """One number for the cell of a grid that a point lies in: far quicker to compare than its three."""
    cells = np.floor(points / voxel).astype(np.int64)
    cells -= cells.min(axis=0)
    shape = cells.max(axis=0) + 1
    return np.asarray((cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2])


def look_at(capture: Capture, track: MaskTrack, frame: Frame, centre_world: Vector3, size_px: int) -> View:
    """The view of one frame that is centred on the object and just holds its mask."""
    mask = unpack_mask(track.masks[frame.index])
    camera, turned = _aim(frame, track, mask, centre_world, size_px)
    new_from_old = turned.inverse.rotation @ frame.world_from_camera.rotation
    rays = np.concatenate(
        [(pixel_centres(camera) - [camera.cx, camera.cy]) / camera.fx, np.ones((size_px, size_px, 1))], axis=2
    )
    old_rays = rays @ new_from_old  # rows times R: the inverse rotation
    old_rays = old_rays / np.maximum(old_rays[..., 2:], 1e-6)
    rgb_px = old_rays[..., :2] * [frame.rgb_camera.fx, frame.rgb_camera.fy] + [frame.rgb_camera.cx, frame.rgb_camera.cy]
    inside = (rgb_px >= 0).all(axis=2) & (rgb_px[..., 0] < frame.rgb_camera.width) & (rgb_px[..., 1] < frame.rgb_camera.height)
    colour, small_mask = _resample(capture.images.rgb(frame.index), mask, rgb_px, camera.fx / frame.rgb_camera.fx)
    depth = _turn_depth(frame, capture.images.depth(frame.index), old_rays, new_from_old)
    small_mask &= inside
    signed, trusted = outline(small_mask, inside, depth)
    return View(
        frame_index=frame.index,
        camera=camera,
        world_from_camera=turned,
        colour=colour,
        mask=small_mask,
        inside=inside,
        depth_m=depth,
        depth_px=camera.fx / frame.depth_camera.fx,
        signed_px=signed,
        outwards=outward_direction(signed),
        trusted=trusted,
    )


def outline(mask: Mask, inside: Mask, depth_m: DepthMetres) -> tuple[np.ndarray, Mask]:
    """Signed distance to the mask's outline, and where the nearest outline pixel is the object's own edge.

    An outline pixel beside the photo's border, or beside something that stands in front, says nothing about the object.
    """
    if not mask.any() or mask.all():
        return np.zeros(mask.shape, np.float32), np.zeros(mask.shape, dtype=bool)
    out_px = ndimage.distance_transform_edt(~mask)
    in_px = ndimage.distance_transform_edt(mask)
    signed = np.where(mask, 0.5 - in_px, out_px - 0.5).astype(np.float32)
    rim = mask & ~ndimage.binary_erosion(mask, border_value=0)
    own = np.where(mask & (depth_m > 0), depth_m, 0.0)
    _, nearest_known = ndimage.distance_transform_edt(own == 0, return_indices=True)
    own_depth = own[tuple(nearest_known)]
    border = np.ones_like(mask)
    border[1:-1, 1:-1] = False
    blocked = (~inside | border) | (~mask & (depth_m > 0) & (depth_m < own_depth - 0.03 - 0.02 * own_depth))
    bad_rim = rim & ndimage.binary_dilation(blocked, iterations=3)
    _, nearest_rim = ndimage.distance_transform_edt(~rim, return_indices=True)
    return signed, ~bad_rim[tuple(nearest_rim)]


def outward_direction(signed_px: np.ndarray) -> np.ndarray:
    """Unit direction (h, w, 2) in which a smoothed signed distance grows; 0 where it hardly does."""
    smooth = cv2.GaussianBlur(signed_px, (0, 0), 1.0, borderType=cv2.BORDER_REFLECT)
    slope_v, slope_u = np.gradient(smooth)
    slope = np.stack([slope_u, slope_v], axis=-1)
    length = np.linalg.norm(slope, axis=-1, keepdims=True)
    return np.where(length > 0.3, slope / np.maximum(length, 1e-6), 0.0).astype(np.float32)


def _aim(frame: Frame, track: MaskTrack, mask: Mask, centre_world: Vector3, size_px: int) -> tuple[Intrinsics, Rigid3]:
    """A square camera at the same place that looks at the middle of the mask and of the object's known box."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    corners_px = np.array([[c, r] for c in (columns[0], columns[-1] + 1) for r in (rows[0], rows[-1] + 1)], dtype=np.float64)
    corners = unproject(corners_px, np.ones(4), frame.rgb_camera)
    known = frame.world_from_camera.inverse.apply(np.concatenate([known_corners(track), centre_world[None]]))
    known = known[known[:, 2] > 0.1]
    rays = _unit(np.concatenate([corners, known]))
    forward = _unit(rays.max(axis=0) + rays.min(axis=0))
    right = _unit(np.cross([0.0, 1.0, 0.0], forward)) if abs(forward[1]) < 0.99 else np.array([1.0, 0.0, 0.0])
    old_from_new = np.column_stack([right, np.cross(forward, right), forward])
    seen = rays @ old_from_new
    reach = float(np.abs(seen[:, :2] / np.maximum(seen[:, 2:], 0.2)).max())
    focal = min(0.5 * size_px / (1.2 * reach), 2.0 * frame.rgb_camera.fx)
    half = size_px / 2
    camera = Intrinsics(fx=focal, fy=focal, cx=half, cy=half, width=size_px, height=size_px)
    return camera, frame.world_from_camera @ Rigid3(old_from_new, np.zeros(3))


def known_corners(track: MaskTrack) -> Points:
    """World corners of the measured front or box; none when the segmenter measured neither."""
    signs = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    corners = [np.zeros((0, 3))]
    if track.front is not None:
        half = signs * [track.front.width_m, 0.0, track.front.height_m]
        corners.append(track.front.world_from_front.apply(half[[0, 1, 4, 5]]))
    if track.box is not None:
        corners.append(track.box.world_from_object.apply(signs * track.box.dimensions_m))
    return np.concatenate(corners)


def _resample(rgb: np.ndarray, mask: Mask, rgb_px: np.ndarray, zoom: float) -> tuple[np.ndarray, Mask]:
    """Photo and mask at the turned camera's pixels; averaged first where the view is smaller, so that nothing aliases."""
    height, width = rgb.shape[:2]
    shrink = min(1.0, 1.25 * zoom)
    size = (max(int(width * shrink), 1), max(int(height * shrink), 1))
    small_rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    small_mask = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    x = (rgb_px[..., 0] * (size[0] / width) - 0.5).astype(np.float32)
    y = (rgb_px[..., 1] * (size[1] / height) - 0.5).astype(np.float32)
    colour = cv2.remap(small_rgb, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    covered = cv2.remap(small_mask, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    return colour.astype(np.float32), covered > 0.5


def _turn_depth(frame: Frame, depth: Depth, old_rays: np.ndarray, new_from_old: np.ndarray) -> DepthMetres:
    """Depth of the nearest depth pixel, expressed along the turned camera's axis."""
    camera = frame.depth_camera
    uv = old_rays[..., :2] * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    known = np.where(depth.valid, depth.metres, 0.0)
    value, within = sample_nearest(known, uv.reshape(-1, 2))
    value = np.where(within, value, 0.0).reshape(old_rays.shape[:2])
    return (value * (old_rays @ new_from_old[2])).astype(np.float32)


def _rough_centre(capture: Capture, track: MaskTrack, frame: Frame) -> Vector3:
    """Where the object is, before its points are gathered."""
    known = known_corners(track)
    if len(known):
        return np.asarray(known.mean(axis=0))
    points = masked_points(frame, capture.images.depth(frame.index), unpack_mask(track.masks[frame.index]))
    if not len(points):
        return np.asarray(frame.world_from_camera.apply(np.array([[0.0, 0.0, 1.0]]))[0])
    return np.asarray(frame.world_from_camera.apply(np.median(points, axis=0)[None])[0])


def _centre(points: Points, track: MaskTrack) -> Vector3:
    """The middle of the visible points, or of the measured box where there are none."""
    if len(points):
        return np.asarray((np.quantile(points, 0.02, axis=0) + np.quantile(points, 0.98, axis=0)) / 2)
    known = known_corners(track)
    return np.asarray(known.mean(axis=0)) if len(known) else np.zeros(3)


def _components(cells: np.ndarray, filled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Label of each cell and the points in each label, cells touching by a corner being one body."""
    if not len(cells):
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    pairs = cKDTree(cells).query_pairs(1.8, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(cells),) * 2)
    count, label = connected_components(graph, directed=False)
    return label, np.bincount(label, filled, minlength=count)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """The same directions with length one."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))
