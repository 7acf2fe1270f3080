"""Pose drift, measured by point-to-plane alignment of views that revisit a surface."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.geometry.camera import depth_points, unproject
from r2c2r_core.geometry.least_squares import Normal, cauchy
from r2c2r_core.ingest.doctor.pairs import Disagreement, Pairs, Views, compare, overlaps, spread, tolerance_m
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of drift measurement."""

    rounds: int = param(5, "count", "Number of Gauss-Newton steps that align one view to another", ge=1)
    apart: float = param(0.25, "share", "Minimum separation of two visits, as a fraction of the recording")
    overlap: float = param(0.3, "share", "Minimum overlap of two visits")
    damping: float = param(
        0.02, "ratio", "Damping relative to the total weight; it holds directions that the surface leaves unconstrained"
    )
    least_points: int = param(80, "count", "Minimum number of points comparable in both views")
    step: tuple[float, float] = param(
        (0.05, 0.05),
        "m",
        "Depth difference of neighbours above which they are separate surfaces: at 0 m, and increase per metre",
    )


def revisits(views: Views, most: int) -> Pairs:
    """Pairs of views of the same surface at very different times, by descending overlap."""
    every, overlap = overlaps(views)
    later = every[:, 1] - every[:, 0] >= max(tuned(Params).apart * len(views.position), 2)
    return spread(every, np.where(later & (overlap > tuned(Params).overlap), overlap, 0.0), most)


def misplaced_m(views: Views, pairs: Pairs) -> np.ndarray:
    """Displacement (pairs,) in metres at the middle of the first view's surface that aligns it to the second's.

    Point-to-plane alignment by depth look-up (Chen and Medioni 1992; KinectFusion 2011); NaN where it finds too little.
    """
    moved = replace(views, rotation=views.rotation.copy(), translation=views.translation.copy())
    return np.array([_misplaced(moved, pair) for pair in pairs])


def _misplaced(views: Views, pair: np.ndarray) -> float:
    first = int(pair[0])
    given = views.rotation[first].copy(), views.translation[first].copy()
    compared = compare(views, pair[None])
    if compared.comparable.sum() < tuned(Params).least_points:
        return float("nan")
    middle = np.median(_points(views, first)[compared.comparable[0]], axis=0)
    surface = _surface(views, int(pair[1]))
    for _ in range(tuned(Params).rounds):
        step = _step(views, pair, compared, surface)
        views.rotation[first] = step[0] @ views.rotation[first]
        views.translation[first] = step[0] @ views.translation[first] + step[1]
        compared = compare(views, pair[None])
    before, after = middle @ given[0].T + given[1], middle @ views.rotation[first].T + views.translation[first]
    agreed = compared.comparable.sum() >= tuned(Params).least_points
    views.rotation[first], views.translation[first] = given  # the next pair starts from the given poses
    return float(np.linalg.norm(after - before)) if agreed else float("nan")


def _step(
    views: Views, pair: np.ndarray, compared: Disagreement, surface: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """One Gauss-Newton step of the first view's pose, in the world: rotation and translation."""
    from scipy.spatial.transform import Rotation

    first, second = int(pair[0]), int(pair[1])
    normals, measured = surface
    row, column = compared.row[0], compared.column[0]
    n, m = normals[row, column], measured[row, column]
    used = compared.comparable[0] & np.isfinite(n).all(axis=1)
    to_world = views.rotation[second]
    n, m = n[used] @ to_world.T, m[used] @ to_world.T + views.translation[second]
    p = _points(views, first)[used] @ views.rotation[first].T + views.translation[first]
    apart = ((m - p) * n).sum(axis=1)
    weight = cauchy(apart, tolerance_m(compared.expected_m[0][used]))
    centre = p.mean(axis=0) if len(p) else np.zeros(3)
    jacobian = np.hstack([np.cross(p - centre, n), n])
    solved = Normal.of(jacobian, -apart, weight).step(tuned(Params).damping * (weight.sum() + 1e-9))
    turn = Rotation.from_rotvec(solved[:3]).as_matrix()
    return turn, centre + solved[3:] - turn @ centre


def _points(views: Views, view: int) -> np.ndarray:
    """Camera-frame points (n, 3) of a view."""
    return unproject(views.point_uv[view], views.point_z[view], views.camera(view))


def _surface(views: Views, view: int) -> tuple[np.ndarray, np.ndarray]:
    """Normals, NaN where unknown or across a step, and points (h, w, 3) of a view's depth image, in its camera frame."""
    depth = views.depth_m[view].astype(np.float64)
    points = depth_points(depth, views.camera(view))
    points[depth == 0] = np.nan
    least, more = tuned(Params).step
    across, down = np.full_like(points, np.nan), np.full_like(points, np.nan)
    across[:, 2:-2] = points[:, 4:] - points[:, :-4]
    down[2:-2] = points[4:] - points[:-4]
    normals = np.cross(across, down)
    step = np.maximum(np.abs(across[..., 2]), np.abs(down[..., 2])) > least + more * depth
    normals[step] = np.nan
    with np.errstate(invalid="ignore"):
        return normals / np.linalg.norm(normals, axis=-1, keepdims=True), points
