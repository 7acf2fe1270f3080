"""Exposure and white balance: images brought to one common gain."""

import cv2
import numpy as np

from r2c2r_core.arrays import Image

Gain = tuple[float, float, float]
"""Factors on the stored values of red, green and blue."""

NO_GAIN: Gain = (1.0, 1.0, 1.0)


_CLIPS_FROM = 200  # of 255: above, a channel may be clipped, and the true value is unknown


def balanced(rgb: Image, gain: Gain) -> Image:
    """The image times its gain; the gain fades out towards white, which is white under any exposure."""
    if gain == NO_GAIN:
        return rgb
    given = np.arange(256, dtype=np.float64)[:, None]
    fade = np.clip((given - _CLIPS_FROM) / (255 - _CLIPS_FROM), 0.0, 1.0)
    table = given * (np.asarray(gain) * (1.0 - fade) + fade)
    return np.asarray(cv2.LUT(rgb, np.clip(np.round(table), 0, 255).astype(np.uint8)[None]))
