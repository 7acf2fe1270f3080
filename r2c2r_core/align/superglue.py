"""Keypoints matched by SuperGlue (Sarlin et al. 2020), as in the paper: for research only.

The weights (magic-leap-community/superglue_indoor, which include SuperPoint's) may not be used commercially.
"""

from types import MappingProxyType
from typing import Any

from r2c2r_core.align.glue import CANVAS_PX, GlueMatcher, Pair


class SuperGlueMatcher(GlueMatcher):
    """Matcher that runs SuperGlueForKeypointMatching."""

    class_name = "SuperGlueForKeypointMatching"
    settings = MappingProxyType({"matching_threshold": 0.2})  # Magic Leap's own; the stored 0 would accept every mutual best

    def _partners(self, pair: Pair) -> Any:
        # private in transformers 5.23 (pinned): the public call repeats the detection for every pair
        match = self._model._match_image_pair
        return match(pair.keypoints, pair.descriptors, pair.scores, CANVAS_PX, CANVAS_PX, mask=pair.mask)[0]
