"""Depth noise model of a recording, estimated from frame residuals against the fused surface."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from r2c2r_core.arrays import DepthMetres, Faces, Points
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.tuning import param, tuned

_MAD_TO_SIGMA = 1.4826  # of a normal distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of depth noise estimation."""

    frames: int = param(
        24,
        "count",
        "Number of frames used, spread over the recording",
        source="the figures of 24 and of all frames of the sample differ by less than 5 %",
        ge=1,
    )
    gross_m: float = param(0.10, "m", "Residual beyond which a pixel is rejected: something moved, or an edge was missed")
    least_pixels: int = param(2000, "count", "Minimum number of pixels for an estimate of how noise grows with distance")
    bins: int = param(8, "count", "Number of distance bins with equal pixel counts", ge=2)


def estimate_depth_noise(frames: Sequence[Frame], images: FrameImages, vertices: Points, faces: Faces) -> DepthNoise:
    """Standard deviation a + b * z of depth about the fused surface; a usual phone's where there are too few pixels.

    `vertices` (n, 3) are in the frames' world (`world_from_camera`). Remaining pose error counts as noise, since any
    comparison of a frame with geometry from other frames contains both.
    """
    params = tuned(Params)
    chosen = frames[:: max(1, len(frames) // params.frames)]
    pairs = [_residuals(frame, images, vertices, faces) for frame in chosen]
    z, residual = (np.concatenate(part) if pairs else np.zeros(0) for part in zip(*pairs, strict=True))
    if len(z) < params.least_pixels:
        return DepthNoise()
    order = np.array_split(np.argsort(z, kind="stable"), params.bins)
    distance = np.array([np.median(z[part]) for part in order])
    sigma = np.array([_MAD_TO_SIGMA * np.median(np.abs(residual[part] - np.median(residual[part]))) for part in order])
    (floor_m, per_m), _ = nnls(np.column_stack([np.ones(params.bins), distance]), sigma)
    return DepthNoise(floor_m=float(floor_m), per_m=float(per_m))


def _residuals(frame: Frame, images: FrameImages, vertices: Points, faces: Faces) -> tuple[np.ndarray, np.ndarray]:
    """(surface depth, measured minus surface depth) of the pixels where both are known, away from surface edges."""
    depth = images.depth(frame.index)
    camera = frame.depth_camera
    nothing = np.zeros((len(vertices), 3), np.float32)
    model = rasterize(vertices, faces, nothing, camera, frame.world_from_camera.inverse).depth_m
    off = depth.metres - model
    known = depth.valid & _smooth(model, camera) & (np.abs(off) < tuned(Params).gross_m)
    return model[known].astype(np.float64), off[known].astype(np.float64)


def _smooth(model: DepthMetres, camera: Intrinsics) -> np.ndarray:
    """Pixels inside a surface seen at less than 60 degrees off its normal, with all four neighbours on it."""
    steepest = np.tan(np.radians(60.0))
    flat = np.zeros(model.shape, bool)
    across = np.abs(model[1:-1, 2:] - model[1:-1, :-2]) * camera.fx
    down = np.abs(model[2:, 1:-1] - model[:-2, 1:-1]) * camera.fy
    whole = (model[1:-1, 2:] > 0) & (model[1:-1, :-2] > 0) & (model[2:, 1:-1] > 0) & (model[:-2, 1:-1] > 0)
    flat[1:-1, 1:-1] = whole & (np.maximum(across, down) < 2.0 * steepest * model[1:-1, 1:-1])
    return flat & (model > 0)
