"""Texture colours at a list of uv coordinates."""

import numpy as np

from r2c2r_core.arrays import Image


def texture_colours(texture: Image, uv: np.ndarray) -> np.ndarray:
    """Bilinear colours (n, 3), float 0..255, at uv (n, 2); v = 0 is the bottom row, borders are repeated."""
    height, width = texture.shape[:2]
    x = np.clip(uv[:, 0] * width - 0.5, 0, width - 1)
    y = np.clip((1.0 - uv[:, 1]) * height - 0.5, 0, height - 1)
    left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    wx, wy = (x - left)[:, None], (y - top)[:, None]
    upper = texture[top, left] * (1 - wx) + texture[top, right] * wx
    lower = texture[bottom, left] * (1 - wx) + texture[bottom, right] * wx
    return np.asarray(upper * (1 - wy) + lower * wy)
