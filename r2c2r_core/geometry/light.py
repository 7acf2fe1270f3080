"""Exposure and white balance: images brought to one common gain."""

import cv2
import numpy as np

from r2c2r_core.arrays import Image

Gain = tuple[float, float, float]
"""Factors on the stored values of red, green and blue."""

NO_GAIN: Gain = (1.0, 1.0, 1.0)


_CLIPS_FROM = 200  # of 255: where all channels are above, they may be clipped, and the true value is unknown


def balanced(rgb: Image, gain: Gain) -> Image:
    """The image times its gain; the gain fades out towards white, which is white under any exposure.

    A pixel that is bright in some channels only is no white: it takes the gain, or it would keep its tint.
    """
    if gain == NO_GAIN:
        return rgb
    values = np.arange(256)
    table = np.clip(np.round(values[:, None] * np.asarray(gain)), 0, 255).astype(np.uint8)
    white = np.clip((values - _CLIPS_FROM) / (255 - _CLIPS_FROM), 0, 1).astype(np.float32)
    red, green, blue = cv2.split(rgb)
    fade = cv2.LUT(cv2.min(cv2.min(red, green), blue), white)
    return np.asarray(cv2.blendLinear(rgb, cv2.LUT(rgb, table[None]), fade, 1 - fade))
