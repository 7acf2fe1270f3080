"""Least-squares similarity between point sets: closed form and refitted; with outliers see consensus.py."""

from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.transforms import Similarity3


class DegenerateFitError(ValueError):
    """Degenerate point set, collinear or coincident, which does not determine a rotation."""


class SimilarityFit(NamedTuple):
    """A transform and its inlier correspondences."""

    target_from_source: Similarity3
    inliers: np.ndarray  # (n,) bool


def umeyama(source: Points, target: Points, *, scale: float | None = None) -> Similarity3:
    """Least-squares similarity from `source` to `target`; never a reflection (Umeyama 1991).

    Replaces the paper's eq. 3-6: eq. 4 accumulates target @ source.T, for which eq. 5 as printed (V U^T) is the inverse, and
    neither carries the sign of the determinant, without which half of all flat fronts come out mirrored. `scale` fixes the
    scale. Raises DegenerateFitError when the points do not determine a rotation.
    """
    if len(source) < 3:
        raise DegenerateFitError(f"{len(source)} correspondences, expected at least 3")
    source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
    p, q = source - source_mean, target - target_mean
    spread = float((p**2).sum(axis=1).mean())
    u, d, vt = np.linalg.svd(q.T @ p / len(p))
    if d[0] <= 0 or d[1] < 1e-9 * d[0]:
        raise DegenerateFitError("the correspondences lie on a line")
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * sign) @ vt
    factor = float((d * sign).sum() / spread) if scale is None else scale
    return Similarity3(factor, rotation, target_mean - factor * rotation @ source_mean)


def umeyama_batch(source: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
    """`umeyama` for k point sets (k, n, 3) at once: scales (k,), rotations (k, 3, 3), translations (k, 3)."""
    weight = np.ones(source.shape[:2]) if weights is None else weights
    weight = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    source_mean = np.einsum("kn,knj->kj", weight, source)
    target_mean = np.einsum("kn,knj->kj", weight, target)
    p, q = source - source_mean[:, None], target - target_mean[:, None]
    u, d, vt = np.linalg.svd((q * weight[..., None]).transpose(0, 2, 1) @ p)
    sign = np.ones_like(d)
    sign[:, 2] = np.sign(np.linalg.det(u @ vt))
    rotations = (u * sign[:, None, :]) @ vt
    spread = (weight[..., None] * p**2).sum(axis=(1, 2))
    scales = (d * sign).sum(axis=1) / np.maximum(spread, 1e-18)
    return scales, rotations, target_mean - scales[:, None] * np.einsum("kij,kj->ki", rotations, source_mean)


def refit(
    source: Points, target: Points, inliers: np.ndarray, limit: np.ndarray, relative_limit: float, minimum_inliers: int
) -> SimilarityFit | None:
    """Alternation between fitting the inliers and selecting them, five times; None when they are too few or collinear."""
    fit: Similarity3 | None = None
    for _ in range(5):
        if np.count_nonzero(inliers) < minimum_inliers:
            return None
        try:
            fit = umeyama(source[inliers], target[inliers])
        except DegenerateFitError:
            return None
        residual = np.linalg.norm(fit.apply(source) - target, axis=1)
        before, inliers = inliers, residual < np.minimum(limit, relative_limit * fit.scale)
        if (before == inliers).all():
            break
    if fit is None or np.count_nonzero(inliers) < minimum_inliers:
        return None
    return SimilarityFit(fit, inliers)
