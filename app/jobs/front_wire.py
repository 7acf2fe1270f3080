"""API encoding of a detected front: certainty, edge confidences, corners in the capture frame and handle."""

from typing import Any

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.segment.certainty import front_certainty


def front_line(panel: FrontPanel, category: str, world_from_capture: Rigid3) -> dict[str, Any]:
    """The front in the format of schemas.FoundFront: corners from top left clockwise; the handle relative to the centre."""
    c, s = np.cos(panel.roll_rad), np.sin(panel.roll_rad)
    corners = panel.at(Rigid3(np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]))).corners
    handle = panel.handle
    return {
        "certainty": round(front_certainty(panel, category_of(category)), 3),
        "edges": [round(sure, 3) for sure in panel.edges],
        "corners_m": world_from_capture.inverse.apply(corners).round(6).tolist(),
        "handle": None
        if handle is None
        else {"left_m": handle.left_m, "bottom_m": handle.bottom_m, "right_m": handle.right_m, "top_m": handle.top_m},
    }
