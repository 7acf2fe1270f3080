"""Similarity transform by consensus of correspondences, from length ratios instead of random triples.

A similarity multiplies every distance by one number. Among the pairs that one inlier forms with all others, those with other
inliers therefore share a length ratio, and form a peak in that correspondence's histogram of ratios; correspondences that are
in one peak and mutually consistent form a clique, which determines the transform. Only the subsets that are tried before the
whole set are random, so the cost grows with the square of the correspondences and hardly with the outlier ratio (a random
triple needs (1 - ratio)^-3 tries: 125 000 at 98 %).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.registration import SimilarityFit, refit, umeyama_batch
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the consensus search."""

    samples: tuple[int, int, int] = param(
        (128, 420, 1400),
        "count",
        "Sizes of the successive samples of correspondences; a larger one only where a smaller is insufficient",
    )
    sure: int = param(12, "count", "Number of inliers in a sample above which a larger consensus cannot be missed")
    batch: int = param(12, "count", "Number of peaks processed together", ge=1)
    members: int = param(64, "count", "Maximum number of correspondences of a peak that are compared with each other", ge=4)
    look: int = param(10, "count", "Number of members that decide whether all members of a peak are compared", ge=1)
    peak: float = param(0.03, "log", "Minimum half width of a peak of scale")


class _Lengths(NamedTuple):
    """Ratios of all distances within a sample of k correspondences."""

    log_ratio: np.ndarray  # (k, k) float32, target over source; inf where either is too short
    tolerance: np.ndarray  # (k, k) float32, three standard deviations of the log ratio
    half_width: float  # half width of a peak


def similarity_consensus(
    source: Points,
    target: Points,
    *,
    threshold: float | np.ndarray,
    rng: np.random.Generator,
    scale_range: tuple[float, float] = (1e-3, 1e3),
    relative_threshold: float = np.inf,
    minimum_inliers: int = 4,
) -> SimilarityFit | None:
    """The similarity with most inliers, refitted on them; None with fewer than `minimum_inliers`.

    `threshold` is in target units, three standard deviations of the noise along an axis, one number or one per correspondence
    (depth noise grows with distance). `relative_threshold` is a fraction of the scaled size of `source`: with an absolute
    threshold alone a tiny scale maps everything next to one cluster and wins. Scale, rotation and translation are estimated
    together (method.md rows 3 and 5).
    """
    params = tuned(Params)
    count = len(source)
    limit = np.broadcast_to(np.asarray(threshold, dtype=np.float64), (count,))
    if count < max(minimum_inliers, 3):
        return None
    relative_limit = relative_threshold * float(np.linalg.norm(np.ptp(source, axis=0)))
    order = rng.permutation(count)
    best = np.zeros(count, dtype=bool)
    for size in params.samples:
        chosen = order[:size]
        for agrees in _cliques(
            source[chosen], target[chosen], limit[chosen], scale_range, relative_limit, patient=size >= count
        ):
            start = np.zeros(count, dtype=bool)
            start[chosen[agrees]] = True
            fit = refit(source, target, start, limit, relative_limit, 3)
            if fit is not None and fit.inliers.sum() > best.sum():
                best = fit.inliers
        if size >= count or best.sum() * size >= params.sure * count:
            break
    return refit(source, target, best, limit, relative_limit, minimum_inliers)


def _cliques(
    source: Points,
    target: Points,
    limit: np.ndarray,
    scale_range: tuple[float, float],
    relative_limit: float,
    *,
    patient: bool,
) -> list[np.ndarray]:
    """Up to three different sets (k,) bool of a sample's correspondences consistent with one similarity, largest first."""
    params = tuned(Params)
    lengths = _measure(source, target, limit)
    rows, log_scales = _peaks(lengths, scale_range)
    found: list[np.ndarray] = []
    done, batch = 0, params.batch
    while done < len(rows):
        part = slice(done, done + batch)
        members, weight = _agreeing(lengths, *_promising(lengths, rows[part], log_scales[part]))
        members, weight = members[weight.sum(axis=1) >= 3], weight[weight.sum(axis=1) >= 3]
        if len(members):
            scales, rotations, shifts = umeyama_batch(source[members], target[members], weight.astype(np.float64))
            placed = (rotations * scales[:, None, None]) @ source.T + shifts[:, :, None]  # (b, 3, k)
            allowed = np.minimum(limit[None], relative_limit * scales[:, None])
            agrees = ((placed - target.T) ** 2).sum(axis=1) < allowed**2
            agrees &= ((scales > scale_range[0]) & (scales < scale_range[1]))[:, None]
            found = _different([*found, *agrees])
        done, batch = done + batch, 4 * batch
        if (found and found[0].sum() >= params.sure) or (done > 4 * params.batch and not patient):
            break
    return found


def _different(sets: list[np.ndarray]) -> list[np.ndarray]:
    """The three largest sets of three or more that share less than half with a larger one."""
    kept: list[np.ndarray] = []
    for agrees in sorted(sets, key=lambda s: -int(s.sum())):
        if len(kept) == 3 or agrees.sum() < 3:
            break
        if all((agrees & k).sum() < 0.5 * agrees.sum() for k in kept):
            kept.append(agrees)
    return kept


def _measure(source: Points, target: Points, limit: np.ndarray) -> _Lengths:
    """Length ratios of all pairs; valid where both lengths are well above zero."""
    of_source, of_target = (cdist(points, points).astype(np.float32) for points in (source, target))
    squared = (limit**2).astype(np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        tolerance = np.sqrt(squared[:, None] + squared) / of_target
        log_ratio = np.log(of_target / of_source)
    usable = (of_source > 0.05 * of_source.max()) & (tolerance < 0.5)
    log_ratio[~usable] = np.inf
    typical = tolerance[::7, ::7][usable[::7, ::7]]
    return _Lengths(log_ratio, tolerance, max(tuned(Params).peak, 0.6 * float(np.median(typical)) if len(typical) else 1.0))


def _peaks(lengths: _Lengths, scale_range: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Correspondences and the log scales that many of their pairs share, by decreasing excess over the mean histogram."""
    count, width = len(lengths.log_ratio), lengths.half_width
    first, end = np.log(scale_range[0]) - width, np.log(scale_range[1]) + width
    known = (lengths.log_ratio > first) & (lengths.log_ratio < end)
    values = lengths.log_ratio[known]
    if not len(values):
        return np.zeros(0, np.int64), np.zeros(0)
    first = float(values.min())
    bins = int((float(values.max()) - first) / width) + 2
    cell = np.repeat(np.arange(count) * bins, known.sum(axis=1)) + ((values - first) / width).astype(np.int64)
    histogram = np.bincount(cell, minlength=count * bins).reshape(count, bins)
    window = histogram[:, :-1] + histogram[:, 1:]
    usual = window.mean(axis=0)
    surprise = ((window - usual) / np.sqrt(usual + 1.0)).ravel()
    surprise[window.ravel() < 3] = -np.inf
    most = min(2 * count, len(surprise))
    top = np.argpartition(-surprise, most - 1)[:most]
    top = top[np.argsort(-surprise[top], kind="stable")]
    top = top[np.isfinite(surprise[top])]
    return top // (bins - 1), first + (top % (bins - 1) + 1) * width


def _promising(lengths: _Lengths, rows: np.ndarray, log_scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Peaks with a member that agrees with many others, tested on few members; all peaks, where there are few."""
    params = tuned(Params)
    if len(rows) <= params.batch:
        return rows, log_scales
    members, inside = _members(lengths, rows, log_scales)
    looked_at = slice(1, 1 + params.look)  # the first is the peak's own, which agrees with all others
    together = _consistent(lengths, log_scales, members[:, looked_at], members) & inside[:, looked_at, None] & inside[:, None]
    best = np.argsort(-together.sum(axis=2).max(axis=1), kind="stable")[: 2 * params.batch]
    return rows[best], log_scales[best]


def _agreeing(lengths: _Lengths, rows: np.ndarray, log_scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each peak (b,), its correspondences (b, m) and a mask (b, m) of those that agree with most of the others."""
    members, kept = _members(lengths, rows, log_scales)
    together = _consistent(lengths, log_scales, members, members)
    for share in (0.5, 0.7):
        degree = (together & kept[:, None, :]).sum(axis=2) * kept
        kept = degree >= np.maximum(share * degree[:, 1:].max(axis=1, keepdims=True), 2)
    return members, kept


def _members(lengths: _Lengths, rows: np.ndarray, log_scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The correspondences (b, m) nearest to each peak, nearest first, and a mask (b, m) of those in it."""
    slack = lengths.tolerance[rows] + 0.5 * lengths.half_width
    with np.errstate(invalid="ignore"):
        off = np.abs(lengths.log_ratio[rows] - log_scales[:, None].astype(np.float32)) / slack
    off[np.arange(len(rows)), rows] = 0.0
    most = min(tuned(Params).members, off.shape[1])
    members = np.argpartition(off, most - 1, axis=1)[:, :most]
    value = np.take_along_axis(off, members, axis=1)
    order = np.argsort(value, axis=1)
    return np.take_along_axis(members, order, axis=1), np.take_along_axis(value, order, axis=1) < 0.8


def _consistent(lengths: _Lengths, log_scales: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Mask of pairs (b, m, n) of correspondences `first` (b, m) and `second` (b, n) with the length ratio of their peak."""
    pair = first[:, :, None] * len(lengths.log_ratio) + second[:, None, :]
    off = np.abs(lengths.log_ratio.ravel()[pair] - log_scales[:, None, None].astype(np.float32))
    return np.asarray(off < 0.8 * lengths.tolerance.ravel()[pair] + 0.5 * lengths.half_width)
