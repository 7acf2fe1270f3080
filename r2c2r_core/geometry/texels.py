"""Bilinear image sampling at a list of positions with OpenCV, whose sampler requires 2D position maps."""

import cv2
import numpy as np

from r2c2r_core.arrays import Image

_WIDTH = 1024  # cv2.remap needs each side below 32767


def texture_colours(texture: Image, uv: np.ndarray) -> np.ndarray:
    """Bilinear colours (n, 3), uint8, at uv (n, 2); v = 0 is the bottom row, borders are repeated."""
    height, width = texture.shape[:2]
    return bilinear_colours(texture, np.column_stack([uv[:, 0] * width, (1.0 - uv[:, 1]) * height]))


def bilinear_colours(image: Image, uv_px: np.ndarray) -> np.ndarray:
    """Bilinear colours (n, 3), uint8, at continuous pixel positions (n, 2); outside gives the border."""
    count, (height, width) = len(uv_px), image.shape[:2]
    places = np.zeros((max(-(-count // _WIDTH), 1) * _WIDTH, 2), np.float32)
    places[:count] = np.clip(np.nan_to_num(uv_px), 0, (width, height)) - 0.5
    x, y = (np.ascontiguousarray(column).reshape(-1, _WIDTH) for column in places.T)
    return np.asarray(cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(-1, 3)[:count])
