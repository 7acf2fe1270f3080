"""Similarity transforms between point sets: closed form, against outliers, and by closest points."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.transforms import Similarity3


class DegenerateFitError(ValueError):
    """The points lie on a line or coincide: they do not fix a rotation."""


class SimilarityFit(NamedTuple):
    """A transform and the correspondences that agree with it."""

    target_from_source: Similarity3
    inliers: np.ndarray  # (n,) bool


class IcpFit(NamedTuple):
    """What closest-point iteration ended with."""

    model_pose: Similarity3  # observed_from_model
    distance_m: np.ndarray  # (n,) observed point to the placed model
    iterations: int


def umeyama(source: Points, target: Points, *, weights: np.ndarray | None = None, scale: float | None = None) -> Similarity3:
    """Similarity taking `source` onto `target` in (weighted) least squares; never a reflection (Umeyama 1991).

    Replaces the paper's eq. 3-6: eq. 4 accumulates target @ source.T, for which eq. 5 as printed (V U^T) is the
    inverse, and neither carries the sign of the determinant, without which half of all flat fronts come out mirrored.
    `scale` freezes the scale. Raises DegenerateFitError when the points fix no rotation.
    """
    weight = np.ones(len(source)) if weights is None else np.asarray(weights, dtype=np.float64)
    total = weight.sum()
    if len(source) < 3 or total <= 0:
        raise DegenerateFitError(f"{len(source)} correspondences, 3 needed")
    weight = weight / total
    source_mean, target_mean = weight @ source, weight @ target
    p, q = source - source_mean, target - target_mean
    spread = float(weight @ (p**2).sum(axis=1))
    u, d, vt = np.linalg.svd((q * weight[:, None]).T @ p)
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


def similarity_ransac(
    source: Points,
    target: Points,
    *,
    threshold: float | np.ndarray,
    rng: np.random.Generator,
    scale_range: tuple[float, float] = (1e-3, 1e3),
    relative_threshold: float = np.inf,
    minimum_inliers: int = 4,
    rounds: int = 160,
) -> SimilarityFit | None:
    """The similarity most correspondences agree with, refitted on them; None when fewer than `minimum_inliers` do.

    `threshold` is in target units, one number or one a correspondence (depth noise grows with distance).
    `relative_threshold` is a fraction of the scaled size of `source`: with an absolute threshold alone a tiny scale
    maps everything beside one cluster and wins. Joint in scale, rotation and translation, from three points a sample
    (method.md rows 3 and 5).
    """
    count = len(source)
    limit = np.broadcast_to(np.asarray(threshold, dtype=np.float64), (count,))
    if count < max(minimum_inliers, 3):
        return None
    size = float(np.linalg.norm(np.ptp(source, axis=0)))
    best_count, best = 0, np.zeros(count, dtype=bool)
    for round_index in range(rounds):
        scales, rotations, shifts = _similar_triangles(source, target, limit, size, scale_range, rng)
        if len(scales):
            best_count, best = _best_of(
                source, target, scales, rotations, shifts, limit, relative_threshold * size, best_count, best, rng
            )
        tried = (round_index + 1) * _BATCH
        if best_count and (1.0 - (best_count / count) ** 3) ** tried < 1e-4:
            break
    if best_count < minimum_inliers:
        return None
    return refit(source, target, best, limit, relative_threshold * size, minimum_inliers)


def refit(
    source: Points, target: Points, inliers: np.ndarray, limit: np.ndarray, relative_limit: float, minimum_inliers: int
) -> SimilarityFit | None:
    """Alternate between fitting the inliers and choosing them, five times; None when they dwindle or line up."""
    fit: Similarity3 | None = None
    for _ in range(5):
        if np.count_nonzero(inliers) < minimum_inliers:
            return None
        try:
            fit = umeyama(source[inliers], target[inliers])
        except DegenerateFitError:
            return None
        residual = np.linalg.norm(fit.apply(source) - target, axis=1)
        inliers = residual < np.minimum(limit, relative_limit * fit.scale)
    if fit is None or np.count_nonzero(inliers) < minimum_inliers:
        return None
    return SimilarityFit(fit, inliers)


def icp(
    observed: Points,
    model: Float[np.ndarray, "m 3"],
    start: Similarity3,
    *,
    free_scale: bool = False,
    keep: float = 0.85,
    iterations: int = 30,
    tree: cKDTree | None = None,
) -> IcpFit:
    """Move `model` under `observed` points by closest points, from observed to model, keeping the nearest share `keep`.

    The direction matters more than the library: the other way round pulls the unseen back of a complete model onto the
    visible front (29 mm instead of 1.3 mm). `start` and the result are observed_from_model.
    """
    index = cKDTree(model) if tree is None else tree
    pose, used = start, 0
    for step in range(iterations):
        used = step + 1
        distance, nearest = index.query(pose.inverse.apply(observed))
        chosen = distance <= np.quantile(distance, keep)
        previous = pose
        pose = umeyama(model[nearest[chosen]], observed[chosen], scale=None if free_scale else pose.scale)
        if _moved(previous, pose, observed) < 1e-6:
            break
    distance, _ = index.query(pose.inverse.apply(observed))
    return IcpFit(pose, distance * pose.scale, used)


_BATCH = 5000


def _moved(before: Similarity3, after: Similarity3, at: Points) -> float:
    """How far the first points move between two poses of the same model."""
    sample = before.inverse.apply(at[:50])
    return float(np.abs(after.apply(sample) - at[:50]).max())


def _similar_triangles(
    source: Points,
    target: Points,
    limit: np.ndarray,
    size: float,
    scale_range: tuple[float, float],
    rng: np.random.Generator,
) -> tuple[np.ndarray, ...]:
    """Transforms of random triples whose triangles are similar within the noise: scales, rotations, translations."""
    triple = rng.integers(0, len(source), (_BATCH, 3))
    p, q = source[triple], target[triple]
    side_p, side_q = _sides(p), _sides(q)
    noise = 2.0 * limit[triple].max(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = side_q / side_p
        stretch = np.log(ratio.max(axis=1) / ratio.min(axis=1))
        tolerance = (noise / side_q).max(axis=1)
    usable = (side_p.min(axis=1) > 0.05 * size) & (side_q.min(axis=1) > noise[:, 0])
    usable &= (stretch < tolerance) & (ratio.min(axis=1) > scale_range[0] / 1.2) & (ratio.max(axis=1) < scale_range[1] * 1.2)
    p, q = p[usable], q[usable]
    if not len(p):
        return np.zeros(0), np.zeros((0, 3, 3)), np.zeros((0, 3))
    scales, rotations, shifts = umeyama_batch(p, q)
    fine = (scales > scale_range[0]) & (scales < scale_range[1])
    return scales[fine], rotations[fine], shifts[fine]


def _sides(triangles: np.ndarray) -> np.ndarray:
    """Side lengths (k, 3) of triangles (k, 3, 3)."""
    return np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)


def _best_of(
    source: Points,
    target: Points,
    scales: np.ndarray,
    rotations: np.ndarray,
    shifts: np.ndarray,
    limit: np.ndarray,
    relative_limit: float,
    best_count: int,
    best: np.ndarray,
    rng: np.random.Generator,
) -> tuple[int, np.ndarray]:
    """The larger of the best so far and the best of these, counted first on a sample, then on everything."""
    sample = rng.permutation(len(source))[:120]
    counts = np.zeros(len(scales), dtype=np.int64)
    for start in range(0, len(scales), 1024):
        part = slice(start, start + 1024)
        turned = (rotations[part] * scales[part, None, None]) @ source[sample].T  # (k, 3, n)
        squared = ((turned + shifts[part, :, None] - target[sample].T) ** 2).sum(axis=1)
        allowed = np.minimum(limit[sample][None], relative_limit * scales[part, None])
        counts[part] = (squared < allowed**2).sum(axis=1)
    for k in np.argsort(-counts, kind="stable")[:30]:
        residual = np.linalg.norm(scales[k] * source @ rotations[k].T + shifts[k] - target, axis=1)
        agrees = residual < np.minimum(limit, relative_limit * scales[k])
        found = int(np.count_nonzero(agrees))
        if found > best_count:
            best_count, best = found, agrees
    return best_count, best
