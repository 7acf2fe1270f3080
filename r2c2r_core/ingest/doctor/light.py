"""Exposure: too bright, too dark, or changing from frame to frame."""

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
    """What of a picture is badly exposed."""

    stops: float = param(0.5, "log", "change of brightness that shows in textures, in powers of two")
    white: int = param(250, "grey", "above, a pixel is white")
    black: int = param(5, "grey", "below, a pixel is black")
    fair: tuple[int, int] = param((20, 235), "grey", "least and most of a pixel whose brightness can be compared")
    least_points: int = param(30, "count", "that two neighbours show alike")


class Light(NamedTuple):
    """Shares of pixels at white and at black in the median frame, and of neighbours that differ by half a stop."""

    white: float
    black: float
    flicker: float


def grey_views(capture: Capture, views: Views) -> Greys:
    """The colour images of the views in grey, at the size of their thinned depth."""
    size = (views.depth_m.shape[2], views.depth_m.shape[1])
    rgb = (capture.images.rgb(capture.frames[p].index) for p in views.position)
    return np.stack([cv2.cvtColor(cv2.resize(image, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY) for image in rgb])


def measure_light(grey: Greys, views: Views, pairs: Pairs) -> Light:
    """Exposure of the views, and how often neighbours show one surface in another brightness."""
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
