"""Cleaning and subsampling of the points inside the masks."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.graphs import components
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of point subsampling."""

    crowd: int = param(
        40, "count", "Number of points examined per point that is kept", source="a long recording has a million", ge=1
    )


def main_body(points: Points) -> np.ndarray:
    """Mask of the points in the object's main connected components, without background seen through slats or past edges."""
    if len(points) < 30:
        return np.ones(len(points), dtype=bool)
    spread = np.quantile(points, 0.95, axis=0) - np.quantile(points, 0.05, axis=0)
    voxel = float(np.clip(np.linalg.norm(spread) / 20, 0.01, 0.04))
    _, first, member, filled = np.unique(_cell_keys(points, voxel), return_index=True, return_inverse=True, return_counts=True)
    cells = np.floor(points[first] / voxel).astype(np.int64)
    dense = filled >= 2
    label = np.full(len(cells), -1)
    label[dense], sizes = _components(cells[dense], filled[dense])
    big = np.flatnonzero(sizes >= 0.25 * sizes.max(initial=0))
    keep = np.isin(label, big)[member.ravel()]
    return keep if keep.sum() >= 0.4 * len(points) else np.ones(len(points), dtype=bool)


def thin_out(points: Points, count: int) -> np.ndarray:
    """Indices of about `count` evenly spread points by voxel subsampling, independent of frame order."""
    if len(points) <= count:
        return np.arange(len(points))
    shuffled = np.random.default_rng(0).permutation(len(points))  # frames disagree by a centimetre: none may take precedence
    shuffled = shuffled[: tuned(Params).crowd * count]
    voxel = 0.002
    while True:
        _, first = np.unique(_cell_keys(points[shuffled], voxel), return_index=True)
        if len(first) <= count:
            return np.sort(shuffled[first])
        voxel *= 1.25


def _cell_keys(points: Points, voxel: float) -> np.ndarray:
    """Scalar key of the grid cell of each point, much faster to compare than three indices."""
    cells = np.floor(points / voxel).astype(np.int64)
    cells -= cells.min(axis=0)
    shape = cells.max(axis=0) + 1
    return np.asarray((cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2])


def _components(cells: np.ndarray, filled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Label of each cell and the number of points per label; cells that touch at a corner are connected."""
    if not len(cells):
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    pairs = cKDTree(cells).query_pairs(1.8, output_type="ndarray")
    label = components(len(cells), pairs)
    return label, np.bincount(label, filled)
