"""SuperPoint keypoints matched by SuperGlue (Sarlin et al. 2020), as the paper does: for research only.

The weights (magic-leap-community/superglue_indoor, which hold SuperPoint's too) may not be used commercially.
"""

from types import MappingProxyType
from typing import Any

from r2c2r_core.align.glue import CANVAS_PX, GlueMatcher, Pair


class SuperGlueMatcher(GlueMatcher):
    """Matches with SuperGlueForKeypointMatching."""

    class_name = "SuperGlueForKeypointMatching"
    settings = MappingProxyType({"matching_threshold": 0.2})  # Magic Leap's own; stored as 0, every mutual best would do

    def _partners(self, pair: Pair) -> Any:
        # private in transformers 5.23 (pinned): the public call detects keypoints anew for every pair
        match = self._model._match_image_pair
        return match(pair.keypoints, pair.descriptors, pair.scores, CANVAS_PX, CANVAS_PX, mask=pair.mask)[0]
