"""Joint bilateral upsampling of depth to colour resolution; each pixel continues one measured surface or stays unknown."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Image
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of depth upsampling."""

    sigma_colour: float = param(
        12.0, "grey", "Standard deviation of the colour difference within one surface (noise and texture)", gt=0
    )
    sigma_px: float = param(0.9, "px", "Standard deviation of the spatial weight, in depth pixels", gt=0)
    same_surface: float = param(
        0.02, "ratio", "Maximum relative difference of inverse depth for two candidates to be one surface"
    )


def upsample_depth(depth_m: DepthMetres, guide: Image) -> DepthMetres:
    """`depth_m` (0 unknown) at the size of `guide`, its colour image; 0 where the nearest depth pixel is unknown.

    Joint bilateral upsampling (Kopf et al. 2007) with a selection instead of the mean: each of the 3 x 3 surrounding depth
    pixels votes, weighted by distance and colour similarity, for its own surface, extrapolated along its slope; only the
    members of the surface with most votes are averaged. A mean of both sides of an edge would give flying pixels.
    """
    params = tuned(Params)
    height, width = guide.shape[:2]
    rows, columns = depth_m.shape
    fine = cv2.cvtColor(guide, cv2.COLOR_RGB2LAB).astype(np.float32)
    coarse = cv2.resize(fine, (columns, rows), interpolation=cv2.INTER_AREA)
    with np.errstate(divide="ignore"):
        inverse = np.where(depth_m > 0, 1.0 / depth_m, 0.0).astype(np.float32)  # of a plane it is linear in the pixels
    slope_x, slope_y = _slopes(inverse)
    x = (np.arange(width, dtype=np.float32) + 0.5) * columns / width - 0.5
    y = (np.arange(height, dtype=np.float32) + 0.5) * rows / height - 0.5
    base_x, base_y = np.rint(x).astype(np.int64), np.rint(y).astype(np.int64)
    said, weight = [], []
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            column, row = np.clip(base_x + dx, 0, columns - 1), np.clip(base_y + dy, 0, rows - 1)
            place = np.ix_(row, column)
            away_x, away_y = (x - column)[None, :], (y - row)[:, None]
            value = inverse[place]
            likeness = ((fine - coarse[place]) ** 2).sum(axis=2)
            votes = np.exp(-(away_x**2 + away_y**2) / (2 * params.sigma_px**2) - likeness / (2 * params.sigma_colour**2)) + 1e-9
            said.append(value + slope_x[place] * away_x + slope_y[place] * away_y)
            weight.append(np.where(value > 0, votes, np.float32(0)))
    best = _winning_surface(said, weight)
    known = depth_m[np.ix_(base_y, base_x)] > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(known & (best > 0), 1.0 / best, 0.0).astype(np.float32)


def _winning_surface(said: list[np.ndarray], weight: list[np.ndarray]) -> np.ndarray:
    """Mean inverse depth of the candidates on the surface with most votes."""
    params = tuned(Params)
    most = np.zeros_like(said[0])
    best = np.zeros_like(said[0])
    for centre, own in zip(said, weight, strict=True):
        total, mean = np.zeros_like(best), np.zeros_like(best)
        for value, votes in zip(said, weight, strict=True):
            counted = np.where(np.abs(value - centre) < params.same_surface * np.abs(centre), votes, np.float32(0))
            total += counted
            mean += counted * value
        better = (total > most) & (own > 0)
        most = np.where(better, total, most)
        best = np.where(better, mean / np.maximum(total, 1e-12), best)
    return best


def _slopes(inverse: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Change of inverse depth per pixel along x and y: the flatter of both sides, 0 where they differ in sign or lack one."""
    slopes = []
    for axis in (1, 0):
        ahead = np.diff(inverse, axis=axis, append=np.take(inverse, [-1], axis=axis))
        behind = np.diff(inverse, axis=axis, prepend=np.take(inverse, [0], axis=axis))
        both = (ahead * behind > 0) & (inverse > 0)
        slopes.append(np.where(both, np.sign(ahead) * np.minimum(np.abs(ahead), np.abs(behind)), 0).astype(np.float32))
    return slopes[0], slopes[1]
