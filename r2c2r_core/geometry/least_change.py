"""Least distance programming: the smallest change that satisfies linear constraints."""

import numpy as np


def least_change(equal: np.ndarray, equal_to: np.ndarray, at_least: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """The shortest y with `equal @ y = equal_to` and `at_least @ y >= bound` (n unknowns; (k, n), (k,), (m, n), (m,)).

    Least distance programming by non-negative least squares (Lawson & Hanson 1974, ch. 23), in the null space of the
    equalities; inconsistent equalities are satisfied in least squares. Raises ValueError for infeasible bounds.
    """
    from scipy.optimize import nnls

    shortest, free = _solved(equal, equal_to)
    rows, needed = at_least @ free, bound - at_least @ shortest
    lengths = np.linalg.norm(rows, axis=1)
    used = lengths > 1e-12
    if (needed[~used] > 1e-9).any():
        raise ValueError("a bound that no solution can satisfy")
    rows, needed = rows[used] / lengths[used, None], needed[used] / lengths[used]  # distances of planes
    if not (needed > 0).any():
        return shortest
    scale = float(needed.max())  # the change is at least this long: solved in these units, or rounding dominates
    stacked = np.vstack([rows.T, needed / scale])
    target = np.append(np.zeros(rows.shape[1]), 1.0)
    multipliers, length = nnls(stacked, target, maxiter=30 * stacked.shape[1])
    if length < 1e-9:
        raise ValueError("bounds that contradict each other")
    residual = stacked @ multipliers - target
    return np.asarray(shortest - free @ (scale * residual[:-1] / residual[-1]))


def _solved(equal: np.ndarray, equal_to: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The shortest solution of equalities, and an orthonormal basis (n, f) of their null space."""
    if len(equal) == 0:
        return np.zeros(equal.shape[1]), np.eye(equal.shape[1])
    u, scales, vt = np.linalg.svd(equal)
    rank = int((scales > 1e-9 * scales[0]).sum())
    return vt[:rank].T @ ((u[:, :rank].T @ equal_to) / scales[:rank]), vt[rank:].T
