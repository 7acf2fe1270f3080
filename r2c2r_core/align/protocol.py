"""What a keypoint matcher must do, and the table of matchers."""

from typing import NamedTuple, Protocol

import numpy as np

from r2c2r_core.arrays import Image, Mask, Pixels
from r2c2r_core.registry import Backend, Registry


class Features(NamedTuple):
    """Keypoints of one image; pixel centres at i + 0.5."""

    uv_px: Pixels
    descriptors: np.ndarray  # (n, d), the matcher's own


class Matches(NamedTuple):
    """Index pairs into two Features."""

    first: np.ndarray  # (k,) int
    second: np.ndarray  # (k,) int


class Matcher(Protocol):
    """Finds the same spots in two images. Features are computed once an image and used in many pairs."""

    def describe(self, image: Image, mask: Mask) -> Features:
        """Keypoints of `image` inside `mask`."""

    def match(self, first: Features, second: Features) -> Matches:
        """Pairs that look alike, one to one."""


MATCHERS = Registry(
    seam="matcher",
    backends=(
        Backend(
            name="sift",
            target="r2c2r_core.align.sift:SiftMatcher",
            needs=("cv2",),
            summary="SIFT with RootSIFT descriptors, ratio and mutual test; no weights",
        ),
    ),
)
