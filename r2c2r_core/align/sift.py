"""SIFT keypoints with RootSIFT descriptors (Arandjelović and Zisserman 2012), ratio and mutual test."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.align.protocol import Features, Matcher, Matches
from r2c2r_core.arrays import Image, Mask
from r2c2r_core.geometry.descriptors import mutual_pairs
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of SIFT detection."""

    margin_px: int = param(
        12, "px", "Margin kept around the mask", source="beyond it is background, which the renders do not have"
    )


class SiftMatcher(Matcher):
    """Weight-free matcher: RootSIFT with ratio and mutual test."""

    def __init__(self, *, keypoints: int = 250, ratio: float = 0.85, contrast: float = 0.02) -> None:
        self._ratio = ratio
        self._keypoints = keypoints
        self._sift = cv2.SIFT_create(contrastThreshold=contrast)  # type: ignore[attr-defined]

    def describe(self, image: Image, mask: Mask) -> Features:
        """The strongest keypoints of `image` inside `mask`."""
        params = tuned(Params)
        left, top, width, height = cv2.boundingRect(mask.astype(np.uint8))
        low, high = (
            np.maximum([left - params.margin_px, top - params.margin_px], 0),
            [left + width + params.margin_px, top + height + params.margin_px],
        )
        part = slice(low[1], high[1]), slice(low[0], high[0])
        grey = cv2.cvtColor(image[part], cv2.COLOR_RGB2GRAY)
        found, descriptors = self._sift.detectAndCompute(grey, mask[part].astype(np.uint8) * 255)
        if descriptors is None or not len(found):
            return Features(np.zeros((0, 2)), np.zeros((0, 128), np.float32))
        # OpenCV's own limit counts keypoints outside the mask.
        strongest = np.argsort([-k.response for k in found], kind="stable")[: self._keypoints]
        uv = np.array([found[k].pt for k in strongest], dtype=np.float64) + low + 0.5
        chosen = descriptors[strongest]
        return Features(uv, np.sqrt(chosen / np.maximum(chosen.sum(axis=1, keepdims=True), 1e-6)).astype(np.float32))

    def match(self, first: Features, second: Features) -> Matches:
        """Mutual nearest neighbours that pass the ratio test."""
        return Matches(*mutual_pairs(first.descriptors, second.descriptors, self._ratio))

    def match_many(self, first: Features, others: Sequence[Features]) -> list[Matches]:
        """Pairs with each of the other images."""
        return [self.match(first, other) for other in others]
