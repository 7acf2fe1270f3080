"""Line evidence on an orthomosaic: a robust score of a straight gap or edge at each column (or row), block by block."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import Tile
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of line scores."""

    block_m: float = param(
        0.03,
        "m",
        "Length along a line over which evidence is pooled, so that a line must be visible along most of its span",
        gt=0,
    )
    scales_m: tuple[float, float] = param((0.005, 0.0075), "m", "Widths of the ridge and of the colour step")
    noise_floor: float = param(0.35, "grey", "Noise added to the spread of line strengths", gt=0)
    max_shift_m: float = param(0.03, "m", "Maximum pose error between frames", source="30 mm on a KinectFusion trajectory")
    roll_cost: float = param(
        1.0,
        "score",
        "Profile energy (sum of squared z-scores) that a roll must add per squared degree: scans are nearly level",
        source="fused poses of a 7-Scenes kitchen roll fronts by 2.5°; faint lines of a small plane favour up to 5° by chance",
    )


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Robust z-scores (blocks, positions); `known` where at least one tile observed both sides."""

    score: np.ndarray
    known: np.ndarray
    block: int  # cells in a block
    ends: np.ndarray | None = None  # the part of the score from depth: where the plane begins or ends


class Scores(NamedTuple):
    """One tile's robust z-scores (blocks, positions) and their weights, 0 where unobserved."""

    score: np.ndarray
    weight: np.ndarray


class ScoredTile(NamedTuple):
    """A tile with the scores of its vertical and of its horizontal lines."""

    tile: Tile
    scores: tuple[Scores, Scores]


def gather(tiles: Sequence[ScoredTile], axis: int, cell_m: float) -> Evidence:
    """Evidence of all tiles, each first slid (at most 3 cm) onto those before it; sets the tiles' shifts.

    Axis 0 looks for vertical lines (positions are columns), axis 1 for horizontal ones. The slide is one-dimensional on
    purpose: two-dimensional correlation on flat panels suffers from the aperture problem.
    """
    reach = round(tuned(Params).max_shift_m / cell_m)
    scored = [tile.scores[axis] for tile in tiles]
    placed: list[np.ndarray] = []  # per tile: its weighted score and its weight, after the slide
    slides: list[int] = []
    total = np.zeros((2, *scored[0][0].shape))
    for score, weight in scored:
        slide = 0
        if placed:
            slide, weight = _placed_on(score, weight, total, reach)
        slides.append(slide)
        placed.append(np.roll(np.stack([score * weight, weight]), slide, axis=2))
        total += placed[-1]
    for i, (score, weight) in enumerate(scored):  # the first tiles met few others: slide all once more
        total -= placed[i]
        if len(placed) > 1:
            slides[i], weight = _placed_on(score, weight, total, reach)
        placed[i] = np.roll(np.stack([score * weight, weight]), slides[i], axis=2)
        total += placed[i]
    middle = round(float(np.median(slides)))
    for (tile, _), slide in zip(tiles, slides, strict=True):
        tile.shift = (float(slide - middle), tile.shift[1]) if axis == 0 else (tile.shift[0], float(slide - middle))
    scores, weights = np.roll(np.sum(placed, axis=0), -middle, axis=2)
    return Evidence(scores / np.maximum(weights, 1e-6), weights > 0, _block(cell_m))


def _placed_on(score: np.ndarray, weight: np.ndarray, reference: np.ndarray, reach: int) -> tuple[int, np.ndarray]:
    """Slide and weight of a tile; the weight is reduced to 15 % where its lines agree at no slide."""
    slide, agreement = _best_slide(score, weight, reference[0], reference[1], reach)
    return (0, weight * 0.15) if agreement < 0.25 else (slide, weight)


def scored(tile: Tile, cell_m: float, allowed: np.ndarray | None = None) -> ScoredTile:
    """Tile with its scores, from the allowed cells (rows, columns)."""
    weight = tile.weight if allowed is None else tile.weight * allowed
    lab = cv2.GaussianBlur(tile.lab, (0, 0), 0.8).astype(np.float32)
    weighted = cv2.multiply(lab, cv2.merge([weight] * 3))
    return ScoredTile(tile, (_scores(weighted, weight, 0, cell_m), _scores(weighted, weight, 1, cell_m)))


def _scores(weighted: np.ndarray, weight: np.ndarray, axis: int, cell_m: float) -> Scores:
    """Scores of colours (rows, columns, 3) premultiplied by their weights (rows, columns)."""
    block = _block(cell_m)
    weights = _pooled(weight, block, axis)
    means = _pooled(weighted, block, axis) / np.maximum(weights, 1e-6 / block)[..., None]
    seen = _pooled((weight > 0).astype(np.float32), block, axis) > 0.6
    total = weights * block
    strength, known = _strength(means, seen, cell_m)
    known[known.sum(axis=1) < 20] = False
    middle = _row_medians(strength, known)
    spread = 1.4826 * _row_medians(np.abs(strength - middle), known) + tuned(Params).noise_floor
    score = np.where(known, np.clip((strength - middle) / spread, -2, 6), np.float32(0))
    quality = float(np.median(total[known])) if known.any() else 0.0
    return Scores(score, np.where(known, np.float32(quality), np.float32(0)))


def _pooled(values: np.ndarray, block: int, axis: int) -> np.ndarray:
    """Means over blocks of a line's length, (blocks, positions, …): rows are pooled for axis 0, columns for axis 1."""
    length = values.shape[axis]
    count = max(1, length // block)
    kept = values[: count * block] if axis == 0 else values[:, : count * block]
    size = (values.shape[1], count) if axis == 0 else (count, values.shape[0])
    pooled = cv2.resize(kept, size, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(pooled if axis == 0 else np.swapaxes(pooled, 0, 1))


def _row_medians(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Median over the known part of each row, (rows, 1); zero where nothing is known."""
    ordered = np.sort(np.where(known, values, np.inf), axis=1)
    count = known.sum(axis=1, keepdims=True)
    pair = np.take_along_axis(
        ordered, np.concatenate([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, values.shape[1] - 1)], axis=1), axis=1
    )
    return np.where(count > 0, pair.mean(axis=1, keepdims=True), 0).astype(values.dtype)


def _strength(means: np.ndarray, seen: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Stronger of a ridge (dark or lit) and a colour step, in grey levels, maximum over two widths; and where it is known."""
    params = tuned(Params)
    best = np.full(means.shape[:2], -9.0, np.float32)
    known = seen.copy()
    for scale_m in params.scales_m:
        k = max(1, round(scale_m / cell_m))
        left, right = np.roll(means, 2 * k, axis=1), np.roll(means, -2 * k, axis=1)
        centre = cv2.blur(means, (k | 1, 1))
        ridge = (left[..., 0] + right[..., 0]) / 2 - centre[..., 0]
        step = 0.5 * np.linalg.norm(np.roll(means, k, axis=1) - np.roll(means, -k, axis=1), axis=2)
        best = np.maximum(best, np.maximum(np.abs(ridge), 0.9 * step))
        known &= np.roll(seen, 2 * k, axis=1) & np.roll(seen, -2 * k, axis=1)
    margin = min(8, means.shape[1] // 4)
    known[:, :margin] = False
    known[:, means.shape[1] - margin :] = False
    return best, known


def _best_slide(score: np.ndarray, weight: np.ndarray, total: np.ndarray, weights: np.ndarray, reach: int) -> tuple[int, float]:
    """Slide in cells that best correlates a tile's profile with the running one, and that correlation."""
    profile = _smooth((score * weight).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-6))
    reference = _smooth(total.sum(axis=0) / np.maximum(weights.sum(axis=0), 1e-6))
    seen, known = weight.sum(axis=0) > 0, weights.sum(axis=0) > 0
    slides = np.arange(-reach, reach + 1)
    both = known & _rolled(seen, slides)
    count = np.maximum(both.sum(axis=1, keepdims=True), 1)
    a, b = np.where(both, _rolled(profile, slides), 0.0), np.where(both, reference, 0.0)
    a, b = (
        np.where(both, a - a.sum(axis=1, keepdims=True) / count, 0),
        np.where(both, b - b.sum(axis=1, keepdims=True) / count, 0),
    )
    agreement = (a * b).sum(axis=1) / (np.sqrt((a * a).sum(axis=1) * (b * b).sum(axis=1)) + 1e-9) - 0.1 * np.abs(slides) / reach
    agreement[both.sum(axis=1) < 40] = -1
    best = int(np.argmax(agreement))
    return (int(slides[best]), float(agreement[best])) if agreement[best] > -1 else (0, -1.0)


def _rolled(values: np.ndarray, slides: np.ndarray) -> np.ndarray:
    """np.roll of a row by each of the slides, (slides, positions), or of one row per slide if `values` is 2-D."""
    at = (np.arange(values.shape[-1]) - slides[:, None]) % values.shape[-1]
    return values[at] if values.ndim == 1 else np.take_along_axis(values, at, axis=1)


def frame_slide(tile: ScoredTile, axis: int, cell_m: float, evidence: Evidence) -> float:
    """Slide in cells that aligns one more frame with finished evidence (0 when undetermined)."""
    score, weight = tile.scores[axis]
    seen = np.where(weight > 0, np.clip(score, 0, 4), 0)
    reference = np.where(evidence.known, np.clip(evidence.score, 0, 4), 0)
    reach = round(tuned(Params).max_shift_m / cell_m)
    values = [
        float((np.roll(seen, slide, axis=1) * reference).sum()) * (1 - 0.15 * abs(slide) / reach)
        for slide in range(-reach, reach + 1)
    ]
    best = int(np.argmax(values))
    return float(best - reach) if values[best] > 0 else 0.0


def find_roll(vertical: Evidence, horizontal: Evidence, most_rad: float = np.radians(5.0)) -> float:
    """In-plane roll of the lines: the rotation of the axes that maximises the energy of the line profiles; 0 if unlikely."""
    level = _sheared_energy(vertical, 0.0) + _sheared_energy(horizontal, 0.0)
    best, best_angle = level, 0.0
    for angle in np.radians(np.arange(-np.degrees(most_rad), np.degrees(most_rad) + 0.01, 0.25)):
        energy = _sheared_energy(vertical, angle) + _sheared_energy(horizontal, -angle)
        if energy > best * (1 + 1e-9):
            best, best_angle = energy, float(angle)
    pays = best > 1.05 * level + tuned(Params).roll_cost * np.degrees(best_angle) ** 2
    return -best_angle if pays else 0.0


def _sheared_energy(evidence: Evidence, angle_rad: float) -> float:
    score, known = evidence.score, evidence.known
    slides = np.round((np.arange(len(score)) - len(score) / 2) * evidence.block * np.tan(angle_rad)).astype(int)
    total = _rolled(np.where(known, np.clip(score, -1, 4), 0), slides).sum(axis=0)
    count = _rolled(known, slides).sum(axis=0)
    profile = np.where(count > 0.4 * len(score), total / np.maximum(count, 1), 0)
    return float((np.clip(profile - np.median(profile), 0, 9) ** 2).sum())


def _block(cell_m: float) -> int:
    return max(1, round(tuned(Params).block_m / cell_m))


def _smooth(profile: np.ndarray) -> np.ndarray:
    return cv2.GaussianBlur(profile[None].astype(np.float32), (0, 0), 1.5)[0]
