"""Line evidence on an ortho mosaic: how surely a straight gap or edge runs at each column (or row), block by block."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.segment.mosaic import Tile

BLOCK_M = 0.03
"""Evidence is pooled over this much of the line's length, so that a line must be seen along most of its span."""
_SCALES_M = (0.005, 0.0075)  # widths of the dark ridge and of the colour step
_NOISE_FLOOR = 0.35  # grey levels: below this, differences mean nothing
_MAX_SHIFT_M = 0.03  # pose error between frames (30 mm on a KinectFusion trajectory)


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Robust z-scores (blocks, positions); `known` where at least one tile saw both sides."""

    score: np.ndarray
    known: np.ndarray
    block: int  # cells in a block
    ends: np.ndarray | None = None  # the part of the score that depth gave: where the plane begins or ends


def gather(tiles: list[Tile], axis: int, cell_m: float, allowed: np.ndarray | None = None) -> Evidence:
    """Evidence of all tiles, each first slid (at most 3 cm) onto those before it; sets the tiles' shifts.

    Axis 0 looks for vertical lines (positions are columns), axis 1 for horizontal ones. The slide is one-dimensional on
    purpose: two-dimensional correlation on flat panels suffers from the aperture problem.
    """
    reach = round(_MAX_SHIFT_M / cell_m)
    scored = [tile_scores(tile, axis, cell_m, allowed) for tile in tiles]
    placed: list[tuple[np.ndarray, np.ndarray]] = []
    slides: list[int] = []
    for score, weight in scored:
        if not placed:
            slides.append(0)
        else:
            slide, weight = _placed_on(score, weight, _sum(placed), reach)
            slides.append(slide)
        placed.append((np.roll(score * weight, slides[-1], axis=1), np.roll(weight, slides[-1], axis=1)))
    for i, (score, weight) in enumerate(scored):  # the first tiles met few others: place all once more
        others = placed[:i] + placed[i + 1 :]
        if others:
            slides[i], weight = _placed_on(score, weight, _sum(others), reach)
        placed[i] = np.roll(score * weight, slides[i], axis=1), np.roll(weight, slides[i], axis=1)
    middle = round(float(np.median(slides)))
    for tile, slide in zip(tiles, slides, strict=True):
        tile.shift = (float(slide - middle), tile.shift[1]) if axis == 0 else (tile.shift[0], float(slide - middle))
    total, weights = (np.roll(part, -middle, axis=1) for part in _sum(placed))
    return Evidence(total / np.maximum(weights, 1e-6), weights > 0, _block(cell_m))


def _sum(placed: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    return np.sum([total for total, _ in placed], axis=0), np.sum([weight for _, weight in placed], axis=0)


def _placed_on(
    score: np.ndarray, weight: np.ndarray, reference: tuple[np.ndarray, np.ndarray], reach: int
) -> tuple[int, np.ndarray]:
    """A tile's slide and its weight: next to nothing where its lines agree with no slide."""
    slide, agreement = _best_slide(score, weight, *reference, reach)
    return (0, weight * 0.15) if agreement < 0.25 else (slide, weight)


def tile_scores(tile: Tile, axis: int, cell_m: float, allowed: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """One tile's z-scores (blocks, positions) and their weights, 0 where unseen."""
    lab = cv2.GaussianBlur(tile.lab, (0, 0), 0.8).astype(np.float32)
    weight = tile.weight if allowed is None else tile.weight * allowed
    if axis == 1:
        lab, weight = lab.transpose(1, 0, 2), weight.T
    block = _block(cell_m)
    count, length = max(1, lab.shape[0] // block), lab.shape[1]
    rows = min(count * block, lab.shape[0])
    lab, weight = lab[:rows], weight[:rows]
    parts = (count, rows // count, length)
    total = weight.reshape(parts).sum(axis=1)
    means = (lab * weight[..., None]).reshape(*parts, 3).sum(axis=1) / np.maximum(total, 1e-6)[..., None]
    seen = (weight > 0).reshape(parts).mean(axis=1) > 0.6
    strength, known = _strength(means, seen, cell_m)
    score = np.zeros_like(strength)
    for i in range(count):
        inside = known[i]
        if inside.sum() < 20:
            known[i] = False
            continue
        middle = np.median(strength[i][inside])
        spread = 1.4826 * np.median(np.abs(strength[i][inside] - middle)) + _NOISE_FLOOR
        score[i] = np.where(inside, np.clip((strength[i] - middle) / spread, -2, 6), 0)
    quality = float(np.median(total[known])) if known.any() else 0.0
    return score, np.where(known, np.float32(quality), np.float32(0))


def _strength(means: np.ndarray, seen: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """The stronger of a dark ridge and a colour step, in grey levels, over two widths."""
    best = np.full(means.shape[:2], -9.0, np.float32)
    known = seen.copy()
    for scale_m in _SCALES_M:
        k = max(1, round(scale_m / cell_m))
        left, right = np.roll(means, 2 * k, axis=1), np.roll(means, -2 * k, axis=1)
        centre = cv2.blur(means, (k | 1, 1))
        ridge = (left[..., 0] + right[..., 0]) / 2 - centre[..., 0]
        step = 0.5 * np.linalg.norm(np.roll(means, k, axis=1) - np.roll(means, -k, axis=1), axis=2)
        best = np.maximum(best, np.maximum(ridge, 0.9 * step))
        known &= np.roll(seen, 2 * k, axis=1) & np.roll(seen, -2 * k, axis=1)
    margin = min(8, means.shape[1] // 4)
    known[:, :margin] = False
    known[:, means.shape[1] - margin :] = False
    return best, known


def _best_slide(score: np.ndarray, weight: np.ndarray, total: np.ndarray, weights: np.ndarray, reach: int) -> tuple[int, float]:
    """The slide in cells that best correlates a tile's profile with the running one, and that correlation."""
    profile = _smooth((score * weight).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-6))
    reference = _smooth(total.sum(axis=0) / np.maximum(weights.sum(axis=0), 1e-6))
    seen, known = weight.sum(axis=0) > 0, weights.sum(axis=0) > 0
    best, best_slide = -1.0, 0
    for slide in range(-reach, reach + 1):
        both = known & np.roll(seen, slide)
        if both.sum() < 40:
            continue
        a, b = np.roll(profile, slide)[both], reference[both]
        a, b = a - a.mean(), b - b.mean()
        agreement = float(a @ b / (np.sqrt((a @ a) * (b @ b)) + 1e-9)) - 0.1 * abs(slide) / reach
        if agreement > best:
            best, best_slide = agreement, slide
    return best_slide, best


def frame_slide(tile: Tile, axis: int, cell_m: float, evidence: Evidence) -> float:
    """The slide in cells that lays one more frame onto finished evidence (0 when nothing decides)."""
    score, weight = tile_scores(tile, axis, cell_m)
    seen = np.where(weight > 0, np.clip(score, 0, 4), 0)
    reference = np.where(evidence.known, np.clip(evidence.score, 0, 4), 0)
    reach = round(_MAX_SHIFT_M / cell_m)
    values = [
        float((np.roll(seen, slide, axis=1) * reference).sum()) * (1 - 0.15 * abs(slide) / reach)
        for slide in range(-reach, reach + 1)
    ]
    best = int(np.argmax(values))
    return float(best - reach) if values[best] > 0 else 0.0


def find_roll(vertical: Evidence, horizontal: Evidence, most_rad: float = np.radians(5.0)) -> float:
    """The in-plane tilt of the lines: the turn of the axes under which the line profiles have most energy."""
    best, best_angle = 1.05 * (_sheared_energy(vertical, 0.0) + _sheared_energy(horizontal, 0.0)), 0.0  # a tilt must pay
    for angle in np.radians(np.arange(-np.degrees(most_rad), np.degrees(most_rad) + 0.01, 0.25)):
        energy = _sheared_energy(vertical, angle) + _sheared_energy(horizontal, -angle)
        if energy > best * (1 + 1e-9):
            best, best_angle = energy, float(angle)
    return -best_angle


def _sheared_energy(evidence: Evidence, angle_rad: float) -> float:
    score, known = evidence.score, evidence.known
    offsets = (np.arange(len(score)) - len(score) / 2) * evidence.block * np.tan(angle_rad)
    total = np.zeros(score.shape[1])
    count = np.zeros(score.shape[1])
    for i, offset in enumerate(offsets):
        slide = round(float(offset))
        total += np.roll(np.where(known[i], np.clip(score[i], -1, 4), 0), slide)
        count += np.roll(known[i], slide)
    profile = np.where(count > 0.4 * len(score), total / np.maximum(count, 1), 0)
    return float((np.clip(profile - np.median(profile), 0, 9) ** 2).sum())


def _block(cell_m: float) -> int:
    return max(1, round(BLOCK_M / cell_m))


def _smooth(profile: np.ndarray) -> np.ndarray:
    return cv2.GaussianBlur(profile[None].astype(np.float32), (0, 0), 1.5)[0]
