"""Depth images: rejection of unreliable pixels, encoding for storage, and hole filling for display."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Mask
from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.tuning import param, tuned

DEPTH_STEP_M = 0.00025  # of the stored uint16: a quarter of the finest sensor step, and 16.4 m of range
_FAR = np.float32(1e6)


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of depth rejection."""

    grazing_deg: float = param(84.0, "deg", "Angle between the ray and the surface normal above which depth is rejected", le=90)
    least_step_m: float = param(
        0.05,
        "m",
        "Minimum depth step between two surfaces, at 0 m",
        source="handles stand out by 3 to 5 cm and are a pixel or two wide: keep every one",
    )
    step_more: float = param(0.006, "m", "Increase of the minimum depth step at 1 m; it grows with the squared distance")
    most_noise_m: float = param(0.015, "m", "Maximum depth difference that is attributed to noise, at 0 m")
    noise_more: float = param(
        0.004,
        "m",
        "Increase of that noise at 1 m; it grows with the squared distance",
        source="three sigma of a Kinect: 1.4 mm/m² one sigma",
    )
    inside: float = param(
        0.2, "share", "Minimum distance of a mixed pixel from both sides of a step, as a fraction of the step"
    )
    ridge: float = param(0.3, "share", "Maximum depth difference within a thin ridge, as a fraction of the noise limit")
    growth: float = param(
        1.5, "ratio", "Maximum growth of the depth range at a step when the window doubles (on a slope it doubles)"
    )


def usable_depth(
    metres: DepthMetres,
    confidence: np.ndarray | None,
    camera: Intrinsics,
    *,
    least_confidence: int,
    near_m: float,
    far_m: float,
) -> DepthMetres:
    """The depth with unreliable pixels set to 0: unknown, out of range, of low confidence, or flying.

    Sensors give structures two or three pixels wide low confidence, so thin ridges are kept one confidence level below.
    """
    depth = np.nan_to_num(metres, nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32, copy=False)
    depth = np.where((depth >= near_m) & (depth <= far_m), depth, np.float32(0))
    if confidence is not None:
        nearly = np.where(confidence >= max(least_confidence - 1, 1), depth, np.float32(0))
        depth = np.where((confidence >= least_confidence) | ridges(nearly), nearly, np.float32(0))
    return np.where(flying_pixels(depth, camera), np.float32(0), depth)


def ridges(depth_m: DepthMetres) -> Mask:
    """Pixels on structures up to four pixels wide in front of farther surface on both sides, along a row or a column."""
    valid = depth_m > 0
    for_min, for_max = np.where(valid, depth_m, _FAR), np.where(valid, depth_m, -_FAR)
    step, margin = _least_step(depth_m), tuned(Params).ridge * _most_noise(depth_m)
    found = np.zeros(depth_m.shape, dtype=bool)
    for axis in (0, 1):
        low, _ = _range(for_min, for_max, 2, across=axis == 1)
        behind = np.minimum(_farthest_beside(for_max, axis), np.flip(_farthest_beside(np.flip(for_max, axis), axis), axis))
        found |= (depth_m < low + margin) & (behind > depth_m + step)
    return found & valid


def flying_pixels(depth_m: DepthMetres, camera: Intrinsics) -> Mask:
    """Flying pixels: between two surfaces, or on a surface seen at too grazing an angle.

    Along a row or a column, a mixed pixel lies well inside the range of its two neighbours on either side, while that range
    hardly grows when the window is doubled, as at a step. On a slanted surface the range doubles with the window, so the
    pixel is kept. The nearest and the farthest pixel of a window are always kept, which preserves handles one pixel wide.
    """
    valid = depth_m > 0
    for_min, for_max = np.where(valid, depth_m, _FAR), np.where(valid, depth_m, -_FAR)
    params, flying = tuned(Params), np.zeros(depth_m.shape, dtype=bool)
    least_step, most_noise = _least_step(depth_m), _most_noise(depth_m)
    for across, focal in ((True, camera.fx), (False, camera.fy)):
        low, high = _range(for_min, for_max, 2, across)
        wide_low, wide_high = _range(for_min, for_max, 4, across)
        step = high - low
        margin = np.minimum(params.inside * step, most_noise)
        between = (depth_m > low + margin) & (depth_m < high - margin)
        flying |= between & (step > least_step) & (wide_high - wide_low < params.growth * step)
        flying |= _steepness(depth_m, across) * focal > depth_m * np.tan(np.radians(params.grazing_deg))
    return flying & valid


def encode_depth(depth_m: DepthMetres) -> np.ndarray:
    """Depth as uint16 in steps of 0.25 mm; 0 is unknown."""
    return np.clip(np.rint(depth_m / DEPTH_STEP_M), 0, 65535).astype(np.uint16)


def decode_depth(stored: np.ndarray) -> DepthMetres:
    """Depth in metres from stored uint16 steps; 0 is unknown."""
    return stored.astype(np.float32) * np.float32(DEPTH_STEP_M)


def fill_for_display(depth_m: DepthMetres) -> DepthMetres:
    """Depth with unknown pixels set to the nearest known one. For display and pixel look-ups only: never fuse it."""
    from scipy.ndimage import distance_transform_edt

    unknown = depth_m == 0
    if unknown.all():
        raise CaptureError("a depth image without a valid pixel cannot be filled", hint="choose another frame")
    rows, columns = distance_transform_edt(unknown, return_distances=False, return_indices=True)
    return np.asarray(depth_m[rows, columns])


def _farthest_beside(for_max: np.ndarray, axis: int) -> np.ndarray:
    """Greatest depth among the four pixels before each along an axis; nothing is known before the first."""
    padded = np.pad(for_max, [(4, 0) if k == axis else (0, 0) for k in (0, 1)], constant_values=-_FAR)
    count = for_max.shape[axis]
    return np.asarray(np.max([padded.take(range(k, k + count), axis) for k in range(4)], axis=0))


def _least_step(depth_m: DepthMetres) -> DepthMetres:
    """Minimum depth step between two surfaces at each pixel's depth, metres."""
    params = tuned(Params)
    return np.float32(params.least_step_m) + np.float32(params.step_more) * depth_m * depth_m


def _most_noise(depth_m: DepthMetres) -> DepthMetres:
    """Maximum depth difference attributed to noise at each pixel's depth, metres."""
    params = tuned(Params)
    return np.float32(params.most_noise_m) + np.float32(params.noise_more) * depth_m * depth_m


def _range(for_min: np.ndarray, for_max: np.ndarray, radius: int, across: bool) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest depth within `radius` pixels along a row (across) or a column."""
    kernel = np.ones((1, 2 * radius + 1) if across else (2 * radius + 1, 1), np.uint8)
    low = cv2.erode(for_min, kernel, borderType=cv2.BORDER_REPLICATE)
    return low, cv2.dilate(for_max, kernel, borderType=cv2.BORDER_REPLICATE)


def _steepness(depth_m: DepthMetres, across: bool) -> np.ndarray:
    """Depth gradient in metres per pixel where both neighbours continue the slope, else 0."""
    ahead = np.zeros_like(depth_m)
    behind = np.zeros_like(depth_m)
    if across:
        ahead[:, :-1] = np.where(depth_m[:, 1:] > 0, depth_m[:, 1:] - depth_m[:, :-1], 0)
        behind[:, 1:] = np.where(depth_m[:, :-1] > 0, depth_m[:, 1:] - depth_m[:, :-1], 0)
    else:
        ahead[:-1] = np.where(depth_m[1:] > 0, depth_m[1:] - depth_m[:-1], 0)
        behind[1:] = np.where(depth_m[:-1] > 0, depth_m[1:] - depth_m[:-1], 0)
    return np.where(ahead * behind > 0, np.minimum(np.abs(ahead), np.abs(behind)), 0)
