"""Exposure measures: overexposure, underexposure and flicker between frames."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import UInt8

from r2c2r_core.ingest.doctor.pairs import Pairs, Views, compare
from r2c2r_core.model.capture import Capture
from r2c2r_core.tuning import param, tuned

Greys = UInt8[np.ndarray, "views rows columns"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of exposure measures."""

    stops: float = param(0.5, "log", "Brightness change between neighbours, in stops (powers of two), above which they flicker")
    white: int = param(250, "grey", "Value above which a pixel is white")
    black: int = param(5, "grey", "Value below which a pixel is black")
    fair: tuple[int, int] = param((20, 235), "grey", "Range of values within which a pixel's brightness is compared")
    least_points: int = param(30, "count", "Minimum number of comparable points of two neighbours")


class Light(NamedTuple):
    """Fractions of white and of black pixels in the median frame, and of neighbours that differ by half a stop."""

    white: float
    black: float
    flicker: float


def grey_views(capture: Capture, views: Views) -> Greys:
    """The views' images in grey, at the size of their subsampled depth."""
    size = (views.depth_m.shape[2], views.depth_m.shape[1])
    rgb = (capture.images.rgb(capture.frames[p].index) for p in views.position)
    return np.stack([cv2.cvtColor(cv2.resize(image, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY) for image in rgb])


def measure_light(grey: Greys, views: Views, pairs: Pairs) -> Light:
    """Exposure of the views, and the fraction of neighbours with a brightness change on the same surface."""
    params, compared = tuned(Params), compare(views, pairs)
    low, high = params.fair
    here = views.point_uv[pairs[:, 0]].astype(np.int64)
    first = grey[pairs[:, 0, None], here[..., 1], here[..., 0]]
    second = grey[pairs[:, 1, None], compared.row, compared.column]
    fair = compared.agrees & (first > low) & (first < high) & (second > low) & (second < high)
    # sRGB: light grows about as the 2.2th power of the value
    stops = 2.2 * np.log2(np.maximum(second, 1) / np.maximum(first, 1).astype(np.float64))
    steps = np.array([np.median(stops[k, fair[k]]) for k in range(len(pairs)) if fair[k].sum() >= params.least_points])
    return Light(
        white=float(np.median((grey > params.white).mean(axis=(1, 2)))),
        black=float(np.median((grey < params.black).mean(axis=(1, 2)))),
        flicker=float((np.abs(steps) > params.stops).mean()) if len(steps) else 0.0,
    )
