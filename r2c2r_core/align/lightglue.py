"""Keypoints matched by LightGlue (Lindenberger et al. 2023).

transformers brings one detector for it, SuperPoint, whose weights are for research only; the matcher itself is
Apache-2.0. Weights with DISK or ALIKED need code from the hub (trust_remote_code), which is not run.
"""

from typing import Any

from r2c2r_core.align.glue import CANVAS_PX, GlueMatcher, Pair


class LightGlueMatcher(GlueMatcher):
    """Matcher that runs LightGlueForKeypointMatching."""

    class_name = "LightGlueForKeypointMatching"

    def _partners(self, pair: Pair) -> Any:
        # private in transformers 5.23 (pinned), as in superglue.py
        match = self._model._match_image_pair
        return match(pair.keypoints, pair.descriptors, CANVAS_PX, CANVAS_PX, mask=pair.mask)[0]
