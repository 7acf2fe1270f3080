"""Expected IoU of a mask with the truth, from the usual error of its border: the confidence of a mask."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Mask, Points
from r2c2r_core.calibration import FITTED, calibrated
from r2c2r_core.geometry.masks import box_around
from r2c2r_core.model.capture import Frame
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the expected IoU."""

    least_px: float = param(0.7, "px", "Minimum border error")
    slope: float = param(0.68, "ratio", "Slope of the calibration of log-odds", source=FITTED, gt=0)
    offset: float = param(1.19, "log", "Offset of the calibration of log-odds", source=FITTED, ge=-10, le=10)
    unlikely_left: float = param(
        0.33,
        "share",
        "Fraction of the expected IoU that is left where the size is implausible for the category",
        source="fronts cut together with their neighbours overlapped them by 0.30 to 0.47 (second generator, seed 0)",
    )
    hidden_cost: float = param(
        0.25, "share", "Fraction of the expected IoU lost by a nearly fully hidden object, whose visible part is a guess"
    )


def expected_iou(mask: Mask, share: float, frame: Frame, points_world: Points, border_m: float, fit: float = 1.0) -> float:
    """Expected IoU (0..1) of a mask that shows a `share` of an object at these points, with a border error of `border_m`.

    `fit` (0..1) is the fit of its size to its category: an object merged with its neighbours fits none.

    A border error of s pixels on one side changes the area by about s times its length; borders of the image are exact.
    """
    params = tuned(Params)
    crop = mask[box_around(mask, 1)].astype(np.uint8)
    if not crop.size:
        return 0.0
    inner = cv2.erode(crop, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))  # not at the image's border
    area = float(crop.sum())
    border = area - float((inner & crop).sum())
    distance = max(float(np.median(frame.world_from_camera.inverse.apply(points_world)[:, 2])), 0.1)
    off_px = max(border_m * frame.rgb_camera.fx / distance, params.least_px)
    whole = params.unlikely_left + (1 - params.unlikely_left) * fit
    claim = area / (area + border * off_px) * (1 - params.hidden_cost * (1 - min(max(share, 0.0), 1.0)))
    return whole * calibrated(claim, params.slope, params.offset)
