"""Pictures brought to one exposure and one white."""

import cv2
import numpy as np

from r2c2r_core.arrays import Image

Gain = tuple[float, float, float]
"""Factors of red, green and blue, of the stored values."""

NO_GAIN: Gain = (1.0, 1.0, 1.0)


_CLIPS_FROM = 200  # of 255: above, a channel may be clipped, and what it lacks is not known


def balanced(rgb: Image, gain: Gain) -> Image:
    """The picture times its gain; towards white, which is white under any exposure, the gain fades out."""
    if gain == NO_GAIN:
        return rgb
    given = np.arange(256, dtype=np.float64)[:, None]
    fade = np.clip((given - _CLIPS_FROM) / (255 - _CLIPS_FROM), 0.0, 1.0)
    table = given * (np.asarray(gain) * (1.0 - fade) + fade)
    return np.asarray(cv2.LUT(rgb, np.clip(np.round(table), 0, 255).astype(np.uint8)[None]))
