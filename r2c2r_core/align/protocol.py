"""Interface of keypoint matchers, and their registry."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from r2c2r_core.arrays import Image, Mask, Pixels
from r2c2r_core.registry import Backend, Registry, Weights


class Features(NamedTuple):
    """Keypoints of one image; pixel centres at i + 0.5."""

    uv_px: Pixels
    descriptors: np.ndarray  # (n, d), matcher-specific


class Matches(NamedTuple):
    """Index pairs into two Features."""

    first: np.ndarray  # (k,) int
    second: np.ndarray  # (k,) int


NO_MATCH = Matches(np.zeros(0, np.int64), np.zeros(0, np.int64))


class Matcher(Protocol):
    """Keypoint matcher of image pairs. Features are computed once per image and used in many pairs.

    A backend names this class as its base, so that the type checker compares them.
    """

    @abstractmethod
    def describe(self, image: Image, mask: Mask) -> Features:
        """Keypoints of `image` inside `mask`."""

    @abstractmethod
    def match(self, first: Features, second: Features) -> Matches:
        """One-to-one pairs of similar keypoints."""

    @abstractmethod
    def match_many(self, first: Features, others: Sequence[Features]) -> list[Matches]:
        """Pairs with each of the other images; a slow matcher may return none for the least similar ones."""


MATCHERS: Registry[Matcher] = Registry(
    seam="matcher",
    group="r2c2r.matchers",
    protocol=Matcher,
    own=(
        Backend(
            name="sift",
            target="r2c2r_core.align.sift:SiftMatcher",
            needs=("cv2",),
            summary="SIFT with RootSIFT descriptors, ratio and mutual test; no weights",
        ),
        Backend(
            name="lightglue",
            target="r2c2r_core.align.lightglue:LightGlueMatcher",
            extra="learned",
            needs=("torch", "transformers"),
            weights=Weights(usual="ETH-CVG/lightglue_superpoint", variable="R2C2R_LIGHTGLUE_WEIGHTS"),
            licence="LightGlue Apache-2.0, its SuperPoint weights for non-commercial research only",
            licence_class="restricted",
            summary="SuperPoint keypoints matched by LightGlue",
        ),
        Backend(
            name="superglue",
            target="r2c2r_core.align.superglue:SuperGlueMatcher",
            extra="learned",
            needs=("torch", "transformers"),
            weights=Weights(usual="magic-leap-community/superglue_indoor", variable="R2C2R_SUPERGLUE_WEIGHTS"),
            licence="Magic Leap: non-commercial research only (SuperPoint and SuperGlue weights)",
            licence_class="restricted",
            summary="SuperPoint keypoints matched by SuperGlue, as in the paper",
        ),
    ),
    setting="align.weights",
)
