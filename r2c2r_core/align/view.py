"""Square view of an object, resampled from one photo: colours, mask, depth and the mask's outline."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from r2c2r_core.arrays import DepthMetres, Mask, Points, Vector3
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, pixel_rays, project, sample_nearest, unproject
from r2c2r_core.geometry.masks import unpack_mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Capture, Depth, Frame
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of occlusion."""

    occluder_gap_m: float = param(0.03, "m", "Minimum depth difference, beyond the noise, for a nearer pixel to be an occluder")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """One photo rotated to look at the object and cropped to a square: a pure rotation, hence exact for a pinhole camera."""

    frame_index: int
    camera: Intrinsics
    world_from_camera: Rigid3
    colour: np.ndarray  # (h, w, 3) float32 RGB
    mask: Mask
    inside: Mask  # the pixel lies in the photo
    depth_m: DepthMetres  # z-depth of this camera, 0 unknown
    noise: DepthNoise
    depth_px: float  # width of one depth pixel, in pixels of this view
    signed_px: np.ndarray  # (h, w) float32, distance to the mask's outline, negative inside
    outwards: (
        np.ndarray
    )  # (h, w, 2) float32, unit direction away from the mask; 0 where the outline is equally near on both sides
    trusted: Mask  # the nearest outline pixel is the object's own edge, not an occluder's or the photo's


def look_at(capture: Capture, track: MaskTrack, frame: Frame, centre_world: Vector3, size_px: int) -> View:
    """Square view of one frame, centred on the object and just containing its mask."""
    mask = unpack_mask(track.masks[frame.index])
    camera, turned = _aim(frame, track, mask, centre_world, size_px)
    new_from_old = turned.inverse.rotation @ frame.world_from_camera.rotation
    rays = pixel_rays(pixel_centres(camera), camera)
    old_rays = rays @ new_from_old  # rows times R: the inverse rotation
    old_rays = old_rays / np.maximum(old_rays[..., 2:], 1e-6)
    rgb_px = project(old_rays, frame.rgb_camera)
    ahead = old_rays[..., 2] > 0
    inside = (
        ahead
        & (rgb_px >= 0).all(axis=2)
        & (rgb_px[..., 0] < frame.rgb_camera.width)
        & (rgb_px[..., 1] < frame.rgb_camera.height)
    )
    colour, small_mask = _resample(capture.images.rgb(frame.index), mask, rgb_px, camera.fx / frame.rgb_camera.fx)
    depth = _turn_depth(frame, capture.images.depth(frame.index), old_rays, new_from_old)
    small_mask &= inside
    signed, trusted = outline(small_mask, inside, depth, capture.depth_noise)
    return View(
        frame_index=frame.index,
        camera=camera,
        world_from_camera=turned,
        colour=colour,
        mask=small_mask,
        inside=inside,
        depth_m=depth,
        noise=capture.depth_noise,
        depth_px=camera.fx / frame.depth_camera.fx,
        signed_px=signed,
        outwards=outward_direction(signed),
        trusted=trusted,
    )


def outline(mask: Mask, inside: Mask, depth_m: DepthMetres, noise: DepthNoise) -> tuple[np.ndarray, Mask]:
    """Signed distance to the mask's outline, and a mask of pixels whose nearest outline pixel is the object's own edge.

    An outline pixel next to the photo's border, or next to an occluder, carries no information on the object.
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
    blocked = (~inside | border) | (~mask & noise.occluded(depth_m, own_depth, tuned(Params).occluder_gap_m))
    bad_rim = rim & ndimage.binary_dilation(blocked, iterations=3)
    _, nearest_rim = ndimage.distance_transform_edt(~rim, return_indices=True)
    return signed, ~bad_rim[tuple(nearest_rim)]


def outward_direction(signed_px: np.ndarray) -> np.ndarray:
    """Unit direction (h, w, 2) in which a smoothed signed distance grows; 0 where its gradient is small."""
    smooth = cv2.GaussianBlur(signed_px, (0, 0), 1.0, borderType=cv2.BORDER_REFLECT)
    slope_v, slope_u = np.gradient(smooth)
    slope = np.stack([slope_u, slope_v], axis=-1)
    length = np.linalg.norm(slope, axis=-1, keepdims=True)
    return np.where(length > 0.3, slope / np.maximum(length, 1e-6), 0.0).astype(np.float32)


def _aim(frame: Frame, track: MaskTrack, mask: Mask, centre_world: Vector3, size_px: int) -> tuple[Intrinsics, Rigid3]:
    """Square camera at the same position, aimed at the centre of the mask and of the object's known box."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    corners_px = np.array([[c, r] for c in (columns[0], columns[-1] + 1) for r in (rows[0], rows[-1] + 1)], dtype=np.float64)
    corners = unproject(corners_px, np.ones(4), frame.rgb_camera)
    known = frame.world_from_camera.inverse.apply(np.concatenate([known_corners(track), centre_world[None]]))
    known = known[known[:, 2] > 0.1]
    rays = unit(np.concatenate([corners, known]))
    forward = unit(rays.max(axis=0) + rays.min(axis=0))
    right = unit(np.cross([0.0, 1.0, 0.0], forward)) if abs(forward[1]) < 0.99 else np.array([1.0, 0.0, 0.0])
    old_from_new = np.column_stack([right, np.cross(forward, right), forward])
    seen = rays @ old_from_new
    reach = float(np.abs(seen[:, :2] / np.maximum(seen[:, 2:], 0.2)).max())
    focal = min(0.5 * size_px / (1.2 * reach), 2.0 * frame.rgb_camera.fx)
    half = size_px / 2
    camera = Intrinsics(fx=focal, fy=focal, cx=half, cy=half, width=size_px, height=size_px)
    return camera, frame.world_from_camera @ Rigid3(old_from_new, np.zeros(3))


def _resample(rgb: np.ndarray, mask: Mask, rgb_px: np.ndarray, zoom: float) -> tuple[np.ndarray, Mask]:
    """Photo and mask at the rotated camera's pixels, area-averaged first where the view is smaller, to avoid aliasing."""
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
    """Depth of the nearest depth pixel, expressed along the rotated camera's axis."""
    uv = project(old_rays, frame.depth_camera)
    known = np.where(depth.valid, depth.metres, 0.0)
    value, within = sample_nearest(known, uv.reshape(-1, 2))
    value = np.where(within.reshape(old_rays.shape[:2]) & (old_rays[..., 2] > 0), value.reshape(old_rays.shape[:2]), 0.0)
    return (value * (old_rays @ new_from_old[2])).astype(np.float32)


def mask_box(view: View) -> np.ndarray:
    """Left, top, right, bottom of the mask, as tangents of the viewing angle; zeros for an empty mask."""
    rows, columns = np.flatnonzero(view.mask.any(axis=1)), np.flatnonzero(view.mask.any(axis=0))
    if not len(rows):
        return np.zeros(4)
    corners_px = np.array([[columns[0], rows[0]], [columns[-1] + 1, rows[-1] + 1]], dtype=np.float64)
    return pixel_rays(corners_px, view.camera)[:, :2].ravel()


def known_corners(track: MaskTrack) -> Points:
    """World corners of the measured front or box; empty when the segmenter measured neither."""
    corners = [np.zeros((0, 3))]
    if track.front is not None:
        corners.append(track.front.corners)
    if track.box is not None:
        corners.append(track.box.world_from_object.apply(box_corners(track.box.dimensions_m)))
    return np.concatenate(corners)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors normalised to length one."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))
