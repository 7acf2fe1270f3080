"""Edges of a box as line segments."""

import numpy as np

from r2c2r_core.arrays import Vector3

_EDGES = ((0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (2, 6), (3, 7))


def box_edges(low: Vector3, high: Vector3) -> np.ndarray:
    """Ends (12, 2, 3) of the edges of the box between two corners, float32."""
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return corners[np.array(_EDGES)].astype(np.float32)
