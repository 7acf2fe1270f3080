"""Matching of image descriptors by mutual nearest neighbours and ratio test."""

import numpy as np


def mutual_pairs(first: np.ndarray, second: np.ndarray, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """Mutual nearest neighbours of unit descriptors `first` (n, d) and `second` (m, d), by rising row of the first.

    The best must be clearly better than the second best: its distance below `ratio` times that one's (Lowe 2004). With fewer
    than two of either the ratio is undefined, and the result is empty.
    """
    if min(len(first), len(second)) < 2:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    likeness = first @ second.T  # of unit vectors: distance^2 = 2 - 2 * likeness
    rows, best, back = np.arange(len(first)), likeness.argmax(axis=1), likeness.argmax(axis=0)
    top = likeness[rows, best]
    likeness[rows, best] = -np.inf
    clear = (1.0 - top) < ratio**2 * (1.0 - likeness.max(axis=1))
    chosen = np.flatnonzero(clear & (back[best] == rows))
    return chosen, best[chosen]
