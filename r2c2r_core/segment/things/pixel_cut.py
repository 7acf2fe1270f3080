"""Foreground segmentation of a crop by min-cut (as GrabCut): colour models and known pixels against contrast edges."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Mask
from r2c2r_core.geometry.graphs import source_side
from r2c2r_core.tuning import param, tuned

_BINS = (16, 32, 32)  # of Lab: lightness changes with the light, hue does not
_CAPACITY_SCALE = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the image cut."""

    largest_px: int = param(
        110,
        "px",
        "Maximum side of the image that is cut; larger ones are cut at a lower resolution and their border upsampled",
        ge=16,
    )
    smooth: float = param(2.5, "score", "Cost of a border between equal colours, as log-odds per pixel")
    most_odds: float = param(2.5, "log", "Maximum absolute log-odds of a colour: colour alone decides no pixel")
    unseen: float = param(2e-4, "share", "Probability of a colour that neither side showed", gt=0, le=1)


@dataclass(frozen=True, slots=True, eq=False)
class ColourModel:
    """Log-odds of colours on the object against its surroundings, over Lab bins."""

    table: np.ndarray

    def odds(self, lab: np.ndarray) -> np.ndarray:
        """Log-odds (h, w) of the pixels of an 8-bit Lab image."""
        return np.asarray(self.table[_bins_of(lab)])


def learn_colours(samples: list[tuple[np.ndarray, Mask, Mask]]) -> ColourModel:
    """Colour model learned from samples (8-bit Lab image, pixels surely on the object, pixels surely off it)."""
    params = tuned(Params)
    on = sum((_histogram(lab[sure]) for lab, sure, _ in samples), np.zeros(_BINS))
    off = sum((_histogram(lab[sure]) for lab, _, sure in samples), np.zeros(_BINS))
    on, off = on / np.maximum(on.sum(), 1.0), off / np.maximum(off.sum(), 1.0)
    odds = np.log((on + params.unseen) / (off + params.unseen))
    return ColourModel(np.clip(odds, -params.most_odds, params.most_odds).astype(np.float32))


def unmixed(odds: np.ndarray) -> np.ndarray:
    """Log-odds (h, w) by colour where 3x3 neighbours agree in sign, else zero: border pixels mix the colours of both sides."""
    around = np.ones((3, 3), np.uint8)
    return np.asarray(np.maximum(cv2.erode(odds, around), 0) + np.minimum(cv2.dilate(odds, around), 0))


def cut_pixels(rgb: Image, odds: np.ndarray, largest_px: int | None = None) -> Mask:
    """Min-cut mask of per-pixel log-odds of the object (h, w), with borders that prefer colour edges."""
    height, width = odds.shape
    shrink = max(1.0, max(height, width) / (largest_px or tuned(Params).largest_px))
    size = (max(4, round(width / shrink)), max(4, round(height / shrink)))
    small_odds = cv2.resize(odds.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    small_rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    mask = _min_cut(small_rgb, small_odds * min(shrink, 2.0))
    if shrink == 1.0:
        return mask
    grown = cv2.resize(mask.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(grown > 0.5)


def _min_cut(rgb: Image, odds: np.ndarray) -> Mask:
    node = np.arange(odds.size).reshape(odds.shape)
    lab = cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB).astype(np.float32)
    pairs: list[tuple[np.ndarray, np.ndarray, float]] = [(node[:, :-1], node[:, 1:], 1.0), (node[:-1], node[1:], 1.0)]
    pairs += [(node[:-1, :-1], node[1:, 1:], 0.7), (node[:-1, 1:], node[1:, :-1], 0.7)]
    flat = lab.reshape(-1, 3)
    steps = [((flat[a.ravel()] - flat[b.ravel()]) ** 2).sum(axis=1) for a, b, _ in pairs]
    usual = 2 * float(np.mean(np.concatenate(steps[:2]))) + 1e-6
    weights = [tuned(Params).smooth * w * (np.exp(-step / usual) + 0.04) for step, (_, _, w) in zip(steps, pairs, strict=True)]
    a = np.concatenate([first.ravel() for first, _, _ in pairs])
    b = np.concatenate([second.ravel() for _, second, _ in pairs])
    weight = np.concatenate(weights)
    ends = (np.clip(sign * odds.ravel(), 0, None) for sign in (1, -1))
    return source_side(a, b, *(value * _CAPACITY_SCALE for value in (weight, *ends))).reshape(odds.shape)


def _histogram(lab: np.ndarray) -> np.ndarray:
    """Smoothed counts of Lab colours (n, 3)."""
    from scipy import ndimage

    counts = np.bincount(np.ravel_multi_index(_bins_of(lab), _BINS), minlength=int(np.prod(_BINS))).reshape(_BINS)
    return np.asarray(ndimage.gaussian_filter(counts.astype(np.float64), 0.7))


def _bins_of(lab: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(lab[..., k].astype(np.int64) * _BINS[k] // 256 for k in range(3))
