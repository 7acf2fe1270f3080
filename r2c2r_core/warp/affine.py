"""Map of a mesh's front onto its primitive's (paper eq. 15-16, corrected): least-squares scale and translation per axis.

Eq. 15's full 2x2 matrix has eight equations for six unknowns and shears doors; a scale per axis and a translation, fitted by
least squares, keep them square (method.md row 23), and the residual is reported. Eq. 16 keeps w, so the depth would not match:
it is scaled too (row 24). A handle is not stretched with its panel: it moves as a rigid piece.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters that separate a mesh's handle from its front."""

    handle_m: float = param(
        0.003,
        "m",
        "Minimum protrusion from the front plane for a vertex to belong to the handle",
        source="bar handles protrude 25-40 mm; a phone's depth leaves a plane even to 3 mm",
    )
    group_m: float = param(0.03, "m", "Side of the cells whose connected components separate handles", gt=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxisMap:
    """x -> scale * x + shift, per axis; scale > 0, so nothing is mirrored."""

    scale: Vector3
    shift: Vector3

    def apply(self, points: Points) -> Points:
        """Mapped points (n, 3)."""
        return points * self.scale + self.shift


def fit_map(source_corners: Points, target_corners: Points, source_depth_m: float, target_depth_m: float) -> AxisMap:
    """Least-squares scale and shift along x and z between corners; y maps front to front and back to back."""
    scale, shift = np.ones(3), np.zeros(3)
    for axis in (0, 2):
        source, target = source_corners[:, axis], target_corners[:, axis]
        centred = source - source.mean()
        scale[axis] = float(centred @ (target - target.mean()) / (centred @ centred))
        shift[axis] = target.mean() - scale[axis] * source.mean()
    scale[1] = target_depth_m / source_depth_m
    shift[1] = target_corners[:, 1].mean() - scale[1] * source_corners[:, 1].mean()
    return AxisMap(scale=scale, shift=shift)


def fit_ranges(low: Vector3, high: Vector3, dimensions_m: Vector3) -> AxisMap:
    """The map from the range low..high to a centred box."""
    scale = dimensions_m / np.maximum(high - low, 1e-6)
    return AxisMap(scale=scale, shift=-scale * (low + high) / 2)


def warp_vertices(vertices: Points, faces: Faces, axis_map: AxisMap, front_y: float) -> Points:
    """Mapped vertices; parts that protrude from the front (at `front_y` before the map) keep their shape."""
    warped = axis_map.apply(vertices)
    target_front = axis_map.scale[1] * front_y + axis_map.shift[1]
    out = vertices[:, 1] < front_y - tuned(Params).handle_m
    for group in handle_groups(vertices, faces, out):
        centre = (vertices[group].min(axis=0) + vertices[group].max(axis=0)) / 2
        moved = vertices[group] + (axis_map.apply(centre) - centre)
        moved[:, 1] = target_front + (vertices[group, 1] - front_y)
        warped[group] = moved
    return warped


def handle_groups(vertices: Points, faces: Faces, out: np.ndarray) -> list[np.ndarray]:
    """Vertices in front of the front plane, grouped where their patches in that plane lie within 3 cm."""
    params = tuned(Params)
    from scipy.ndimage import label

    index = np.flatnonzero(out)
    if len(index) == 0:
        return []
    points = _with_edges(vertices, faces, out)
    low = points.min(axis=0)
    cells = np.floor((points - low) / params.group_m).astype(np.int64)
    grid = np.zeros(cells.max(axis=0) + 1, dtype=bool)
    grid[tuple(cells.T)] = True
    labels, count = label(grid, structure=np.ones((3, 3)))
    own = np.floor((vertices[index][:, [0, 2]] - low) / params.group_m).astype(np.int64)
    of_vertex = labels[tuple(own.T)]
    return [index[of_vertex == n] for n in range(1, count + 1) if (of_vertex == n).any()]


def _with_edges(vertices: Points, faces: Faces, out: np.ndarray) -> np.ndarray:
    """Positions (x, z) of the protruding vertices and along the edges between them: long bars have few vertices."""
    inside = faces[out[faces].all(axis=1)]
    flat = vertices[:, [0, 2]]
    samples = [flat[out]]
    for a, b in ((0, 1), (1, 2), (2, 0)):
        start, end = flat[inside[:, a]], flat[inside[:, b]]
        samples += [start + t * (end - start) for t in np.linspace(0.1, 0.9, 9)]
    return np.concatenate(samples)
