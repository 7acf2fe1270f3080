"""The paper's own corners and affine map (sections 4.8-4.9, eq. 15-16), for comparison.

Choices where the paper is open: the factor that prefers the front goes from 1 at the back to 2 at the front. Eq. 15's four
corners give eight equations for six unknowns, so the map is the least-squares one and its residual is the deviation from
"exactly" (method.md rows 22-24). Nothing is corrected: handle tips may be picked, shear is kept, depth is not fitted.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Matrix3, Points, Vector3

_QUADRANTS = ((1, 1), (-1, 1), (-1, -1), (1, -1))  # signs of x and z: top right, top left, bottom left, bottom right


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaperMap:
    """Affine map: (u, v) in the source's frame through A and t, depth w kept, expressed in the target's frame."""

    source_centre: Vector3
    source_axes: Matrix3  # rows: u, v, depth
    target_centre: Vector3
    target_axes: Matrix3
    matrix: np.ndarray  # (2, 2), A
    shift: np.ndarray  # (2,), t
    residual_m: float  # largest distance of a mapped corner from its target in the uv plane

    def apply(self, points: Points) -> Points:
        """Mapped points (n, 3)."""
        local = (points - self.source_centre) @ self.source_axes.T
        local[:, :2] = local[:, :2] @ self.matrix.T + self.shift
        return local @ self.target_axes + self.target_centre


def paper_corners(vertices: Points) -> Points | None:
    """The vertex of the highest score in each quadrant (4, 3); None when a quadrant holds none."""
    centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    x, y, z = (vertices - centre).T
    score = np.hypot(x, z) * (1.0 + (y.max() - y) / max(float(np.ptp(y)), 1e-9))
    corners = []
    for right, up in _QUADRANTS:
        inside = np.flatnonzero((x * right > 0) & (z * up > 0))
        if len(inside) == 0:
            return None
        corners.append(vertices[inside[np.argmax(score[inside])]])
    return np.array(corners)


def fit_paper_map(source: Points, target: Points) -> PaperMap | None:
    """Eq. 15 between two sets of four corners, ordered as `paper_corners`; None when either does not span a plane."""
    frames = _frame(source), _frame(target)
    if frames[0] is None or frames[1] is None:
        return None
    (source_centre, source_axes), (target_centre, target_axes) = frames[0], frames[1]
    uv = ((source - source_centre) @ source_axes.T)[:, :2]
    uv_target = ((target - target_centre) @ target_axes.T)[:, :2]
    solution = np.linalg.lstsq(np.column_stack([uv, np.ones(4)]), uv_target, rcond=None)[0]
    missed = np.column_stack([uv, np.ones(4)]) @ solution - uv_target
    return PaperMap(
        source_centre=source_centre,
        source_axes=source_axes,
        target_centre=target_centre,
        target_axes=target_axes,
        matrix=solution[:2].T,
        shift=solution[2],
        residual_m=float(np.linalg.norm(missed, axis=1).max()),
    )


def _frame(corners: Points) -> tuple[Vector3, Matrix3] | None:
    """Centroid and orthonormal axes (rows): along the top edge to the right, up, and outwards."""
    right = corners[0] - corners[1] + corners[3] - corners[2]
    up = corners[0] - corners[3] + corners[1] - corners[2]
    depth = np.cross(right, up)
    if np.linalg.norm(right) < 1e-9 or np.linalg.norm(depth) < 1e-12:
        return None
    u, w = right / np.linalg.norm(right), depth / np.linalg.norm(depth)
    return corners.mean(axis=0), np.stack([u, np.cross(w, u), w])
