"""Per-frame exposure and white-balance gains, estimated jointly from surface points seen in several frames.

A phone adapts both while filming, so doors of one colour differ between frames. The logarithm of a stored value is modelled
as the surface's log colour minus the frame's log gain; both are solved together by robust least squares (outliers: highlights,
moved objects, poses a pixel off). Stored values are gamma-encoded, under which a gain of light remains a gain of values.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.least_squares import cauchy
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.ingest.planes import sample_surface
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of gain estimation."""

    frames: int = param(
        120, "count", "Maximum number of frames used, spread over the recording; gains in between are interpolated", ge=2
    )
    points: int = param(4000, "count", "Number of surface points sampled by area", ge=10)
    width_px: int = param(160, "px", "Width of the downscaled images; at full size, poses are a pixel or two off", ge=16)
    darkest: int = param(
        20, "grey", "Channel value at or below which a sample is rejected, as noise and black offset hide the gain"
    )
    brightest: int = param(235, "grey", "Channel value at or above which a sample is rejected as clipped")
    hidden_m: float = param(0.03, "m", "Depth difference beyond the noise, in front or behind, at which a point is not seen")
    outlier: float = param(
        0.12, "log", "Cauchy scale: residual at which an observation's weight is halved", source="a highlight is 0.3 and more"
    )
    held: float = param(
        0.5, "log", "Standard deviation of the zero-mean prior on gains", source="a stop of light is 0.32 of stored value"
    )
    most: float = param(0.7, "log", "Maximum absolute log gain (two stops); larger ones are clipped")
    least_looks: int = param(200, "count", "Minimum number of observations in a frame for its gain to be estimated")
    least_gain: float = param(0.1, "share", "Minimum reduction of the colour spread for gains to be applied")
    rounds: int = param(8, "count", "Number of IRLS iterations", ge=1)


class Looks(NamedTuple):
    """Colour observations of surface points, one row per point and frame."""

    point: np.ndarray  # (n,)
    frame: np.ndarray  # (n,) position
    log_rgb: np.ndarray  # (n, 3)


def balance_exposure(
    frames: Sequence[Frame],
    images: FrameImages,
    vertices: Points,
    faces: Faces,
    noise: DepthNoise,
    rng: np.random.Generator,
    progress: Progress = SILENT,
) -> tuple[Frame, ...]:
    """Frames with gains that equalise exposure and white balance over them; unchanged where that hardly reduces the spread."""
    params = tuned(Params)
    chosen = frames[:: max(1, len(frames) // params.frames)]
    points = sample_surface(vertices, faces, params.points, rng).points
    looks = see(chosen, images, points, noise, progress)
    log_gains = solve_gains(looks, len(chosen))
    before, after = spread(looks, np.zeros_like(log_gains)), spread(looks, log_gains)
    if not after < (1.0 - params.least_gain) * before:
        return tuple(frames)
    numbers = np.array([f.index for f in chosen], dtype=np.float64)
    gains = [np.exp([np.interp(f.index, numbers, channel) for channel in log_gains.T]) for f in frames]
    return tuple(replace(f, gain=(float(g[0]), float(g[1]), float(g[2]))) for f, g in zip(frames, gains, strict=True))


def see(frames: Sequence[Frame], images: FrameImages, points: Points, noise: DepthNoise, progress: Progress = SILENT) -> Looks:
    """Colour observations of points confirmed by each frame's depth, neither clipped nor black."""
    params = tuned(Params)
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for position, frame in enumerate(frames):
        progress.at(position / len(frames), f"comparing exposures {position + 1}/{len(frames)}")
        local = frame.world_from_camera.inverse.apply(points)
        front = np.flatnonzero(local[:, 2] > 0.1)
        measured, inside = sample_nearest(images.depth(frame.index).metres, project(local[front], frame.depth_camera))
        z = local[front, 2]
        other = noise.occluded(measured, z, params.hidden_m) | noise.seen_through(measured, z, params.hidden_m)
        seen = front[inside & (measured > 0) & ~other]
        camera = frame.rgb_camera
        small = camera.resized(params.width_px, max(1, round(camera.height * params.width_px / camera.width)))
        picture = cv2.resize(images.rgb(frame.index), (small.width, small.height), interpolation=cv2.INTER_AREA)
        colour, inside = sample_nearest(picture, project(local[seen], small))
        usable = inside & (colour.min(axis=1) > params.darkest) & (colour.max(axis=1) < params.brightest)
        parts.append((seen[usable], np.full(int(usable.sum()), position), np.log(colour[usable].astype(np.float64))))
    point, at, log_rgb = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Looks(point, at, log_rgb.reshape(-1, 3))


def solve_gains(looks: Looks, frames: int) -> np.ndarray:
    """Log gains (frames, 3) by IRLS with Cauchy weights; 0 for frames with too few observations."""
    params = tuned(Params)
    shows = np.bincount(looks.frame, minlength=frames) >= params.least_looks
    gains = np.zeros((frames, 3))
    if not shows.any():
        return gains
    weight = np.where(shows[looks.frame], 1.0, 0.0)
    for _ in range(params.rounds):
        for channel in range(3):
            gains[:, channel] = _solved(looks, looks.log_rgb[:, channel], weight, frames, params.held)
        residual = np.linalg.norm(looks.log_rgb + gains[looks.frame] - _surface(looks, gains, weight)[looks.point], axis=1)
        weight = np.where(shows[looks.frame], cauchy(residual, params.outlier), 0.0)
    gains -= np.median(gains[shows], axis=0)
    return np.clip(np.where(shows[:, None], gains, 0.0), -params.most, params.most)


def spread(looks: Looks, gains: np.ndarray) -> float:
    """Median over points seen at least five times of the robust standard deviation (MAD) of their log colour over frames."""
    value = looks.log_rgb + gains[looks.frame]
    counts = np.bincount(looks.point)
    enough = counts >= 5
    if not enough.any():
        return 0.0
    kept = enough[looks.point]
    counts, group, value = counts[enough], (np.cumsum(enough) - 1)[looks.point[kept]], value[kept]
    middle = _medians(value, group, counts)
    apart = _medians(np.abs(value - middle[group]), group, counts)
    return float(np.median(1.4826 * apart.mean(axis=1)))


def _medians(value: np.ndarray, group: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Median (groups, channels) of each group's rows, vectorised: separate calls for a few rows each take seconds."""
    ends = np.cumsum(counts)
    low, high = ends - counts + (counts - 1) // 2, ends - counts + counts // 2
    ordered = np.stack([channel[np.lexsort((channel, group))] for channel in value.T], axis=1)
    return np.asarray((ordered[low] + ordered[high]) / 2.0)


def _solved(looks: Looks, value: np.ndarray, weight: np.ndarray, frames: int, held: float) -> np.ndarray:
    """Gains of one channel: normal equations with the points' values eliminated (Schur complement)."""
    points = int(looks.point.max()) + 1
    table = np.zeros((points, frames))
    np.add.at(table, (looks.point, looks.frame), weight)
    total = np.maximum(table.sum(axis=1), 1e-12)
    matrix = np.diag(table.sum(axis=0) + 1.0 / held**2) - table.T @ (table / total[:, None])
    mean = np.bincount(looks.point, weight * value, points) / total
    pull = np.bincount(looks.frame, weight * (mean[looks.point] - value), frames)
    return np.asarray(np.linalg.solve(matrix, pull))


def _surface(looks: Looks, gains: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Log colour of each point (points, 3): the weighted mean of its observations."""
    points = int(looks.point.max()) + 1
    total = np.maximum(np.bincount(looks.point, weight, points), 1e-12)
    value = looks.log_rgb + gains[looks.frame]
    return np.stack([np.bincount(looks.point, weight * value[:, c], points) / total for c in range(3)], axis=1)
