"""Contact of moving convex bodies."""

import numpy as np

from r2c2r_core.arrays import Points, Vector3


def last_contact(moving: Points, still: np.ndarray, direction: Vector3) -> float | None:
    """Distance along a direction after which the hull of `moving` (n, 3) has left that of `still` (m, 3).

    Negative where it lies beyond it already; None where it never meets it on that line. A linear program over their points.
    """
    from scipy.optimize import linprog

    across = np.linalg.svd(direction[None])[2][1:]
    low, high = (np.array([end(points @ across.T, axis=0) for points in (moving, still)]) for end in (np.min, np.max))
    if (low.max(axis=0) >= high.min(axis=0)).any():
        return None
    n, m = len(moving), len(still)
    equal = np.zeros((5, n + m + 1))
    equal[0, :n] = equal[1, n : n + m] = 1.0
    equal[2:, :n], equal[2:, n : n + m], equal[2:, -1] = moving.T, -still.T, direction
    farthest, bounds = np.zeros(n + m + 1), [*[(0.0, None)] * (n + m), (None, None)]
    farthest[-1] = -1.0
    found = linprog(farthest, A_eq=equal, b_eq=[1.0, 1.0, 0.0, 0.0, 0.0], bounds=bounds, method="highs")
    return -float(found.fun) if found.status == 0 else None
