"""Crops of elevations drawn at random: what the seam network is fed, and what is true."""

import cv2
import numpy as np

from r2c2r_core.segment.mosaics.panel_net import features
from training.elevations import draw
from training.sight import seen

SIZE = 256  # cells of 5 mm


def crops(seed: int, count: int = 4) -> list[tuple[np.ndarray, np.ndarray]]:
    """Features (19, 256, 256) as float16 and truth (4, 256, 256): 0 no, 1 yes, 2 too near a line to say."""
    sight = seen(draw(seed))
    rng = np.random.default_rng((seed, 1))
    inputs = features(sight.mosaic, sight.count, sight.raised, sight.level_m)
    truth = np.stack([_truth(layer, line=k < 2) for k, layer in enumerate(sight.truth)])
    pad = [(0, 0), *((0, max(SIZE - extent, 0)) for extent in inputs.shape[1:])]
    inputs, truth = np.pad(inputs, pad), np.pad(truth, pad)
    found: list[tuple[np.ndarray, np.ndarray]] = []
    while len(found) < count:
        y, x = (int(rng.integers(0, extent - SIZE + 1)) for extent in inputs.shape[1:])
        area = (slice(None), slice(y, y + SIZE), slice(x, x + SIZE))
        if truth[3][area[1:]].mean() < 0.15 and rng.random() < 0.9:  # mostly wall: few are enough
            continue
        found.append((inputs[area].astype(np.float16), truth[area].copy()))
    return found


def _truth(layer: np.ndarray, *, line: bool) -> np.ndarray:
    rows, columns = layer.shape[0] // 2, layer.shape[1] // 2
    blocks = layer[: rows * 2, : columns * 2].reshape(rows, 2, columns, 2)
    if not line:
        return (blocks.mean(axis=(1, 3)) >= 0.5).astype(np.uint8)
    on = blocks.max(axis=(1, 3))
    near = cv2.dilate(on, np.ones((3, 3), np.uint8))
    return np.where(on > 0, 1, np.where(near > 0, 2, 0)).astype(np.uint8)
