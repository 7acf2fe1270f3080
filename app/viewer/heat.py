"""Heat maps of the distance of surfaces to the scan."""

from typing import Literal, get_args

import cv2
import numpy as np
from scipy.spatial import cKDTree

from r2c2r_core.arrays import Points

Heat = Literal["distance", "unobserved"]
HEATS: tuple[Heat, ...] = get_args(Heat)
RANGE_M: dict[Heat, float] = {"distance": 0.03, "unobserved": 0.5}  # at which the last colour begins, as in the page's legend
EDGE_M = 0.04  # maximum edge length of coloured triangles
_NOT_MEASURED_M = 0.06  # a larger distance is not an error: nothing was measured there
_GREY = np.array([110, 110, 110], dtype=np.uint8)


def colours(heat: Heat, tree: cKDTree, points_world: Points) -> np.ndarray:
    """RGB (n, 3) of points: from dark to light, colour-blind safe; grey where a distance is not an error."""
    distance = np.asarray(tree.query(points_world)[0])
    share = np.clip(distance / RANGE_M[heat], 0.0, 1.0)
    table = cv2.COLORMAP_VIRIDIS if heat == "distance" else cv2.COLORMAP_MAGMA
    found = cv2.applyColorMap((255 * share).astype(np.uint8).reshape(-1, 1), table)[:, 0, ::-1]
    if heat == "distance":
        found = np.where((distance > _NOT_MEASURED_M)[:, None], _GREY, found)
    return np.ascontiguousarray(found)
