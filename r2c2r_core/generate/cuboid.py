"""Upright cuboid fitted to silhouettes and depth by robust least squares; oblique frames constrain the unobserved depth.

A front seen squarely gives no information on the depth behind it, and a phone's depth near an outline mixes with the wall, so
extents of points are wrong where a side is seen only at a flat angle. The outline of a box, however, is that of its corners:
one joint robust least-squares fit over all frames to outline pixels and depth points, with each frame's pose error (a shift of
its outline) projected out, estimates yaw and sides together, and its covariance tells which sides the scan constrains.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.generate.evidence import View
from r2c2r_core.geometry.boxes import box_corners, upright_box
from r2c2r_core.geometry.camera import project, sample_nearest, unproject
from r2c2r_core.geometry.least_squares import cauchy, cauchy_loss
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.model.capture import Wall
from r2c2r_core.tuning import param, tuned

_YAW_RAD = np.pi  # weak prior: the local frame's own yaw carries almost no information
_WALL_ROW, _USUAL_ROW = -3, -1  # rows of the residuals: priors on the depth that no frame shows


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned noise levels, priors and iterations of the cuboid fit."""

    outline_samples: int = param(80, "count", "Approximate number of outline pixels sampled per view", ge=8)
    points: int = param(1200, "count", "Approximate number of depth points in the fit", ge=10)
    outline_m: float = param(0.004, "m", "Standard deviation of an outline pixel", gt=0)
    depth_m: float = param(0.008, "m", "Standard deviation of a depth point", gt=0)
    independent: float = param(
        12.0,
        "count",
        "Effective number of independent outline pixels, and depth points, per frame: neighbours' errors correlate",
        gt=0,
    )
    robust: float = param(
        2.5, "σ", "Residual, in standard deviations, at which the Cauchy kernel starts to discount outliers", gt=0
    )
    shift_m: float = param(0.006, "m", "Standard deviation of a frame's pose error across the view", gt=0)
    wall_m: float = param(0.003, "m", "Standard deviation of how far a box may penetrate a wall", gt=0)
    usual_depth: float = param(
        0.5, "ratio", "Prior mean of the ratio of depth to width, the only information for a box seen squarely", gt=0
    )
    depth_spread: float = param(0.35, "ratio", "Standard deviation of the depth prior, relative to the width", gt=0)
    starts: tuple[float, float, float] = param(
        (0.25, 0.5, 1.0), "ratio", "Ratios of depth to width at which the fit is initialised"
    )
    same_yaw_rad: float = param(float(np.radians(2.0)), "rad", "Yaw difference below which two initial yaws count as the same")
    no_box_m: float = param(0.012, "m", "Maximum median distance of the depth points from the box for it to be accepted")
    rough_rounds: int = param(8, "count", "Maximum function evaluations of the coarse fit", ge=1)
    rounds: int = param(12, "count", "Maximum function evaluations of the final fit", ge=1)
    along_px: float = param(2.5, "px", "Offset to either side of an outline at which depth decides whose outline it is")
    before_m: float = param(
        0.03, "m", "Depth step from inside to outside the outline above which a nearer object occludes this one"
    )


class Cuboid(NamedTuple):
    """An upright cuboid with the uncertainty of its sides."""

    world_from_cuboid: Rigid3  # origin at its centre, +Z up, -Y towards the cameras
    size_m: Vector3
    sigma_m: Vector3  # standard deviation of each size from the frames alone
    depth_spread_m: float  # standard deviation of the depth including the priors: walls and the usual ratio
    cost: float


class _Outline(NamedTuple):
    """Outline pixels of one view that belong to the object's own edge."""

    view: View
    uv_px: np.ndarray
    metres_per_px: float


def fit_cuboid(
    points_local: Points,
    low: Vector3,
    high: Vector3,
    views: Sequence[View],
    world_from_local: Rigid3,
    walls: Sequence[Wall],
) -> Cuboid | None:
    """Cuboid fitted to points and outlines, started from the box `low`..`high` of the local frame.

    None without three outlines, or where the points do not lie on a box. The bottom, `low[2]`, is the support height and stays
    fixed. Walls are the room's, in the world frame.
    """
    params = tuned(Params)
    outlines = [found for view in views if (found := _own_outline(view)) is not None]
    if len(outlines) < 3:
        return None
    chosen = points_local[:: max(len(points_local) // params.points, 1)]
    bottom = float(low[2])
    coarse = [o._replace(uv_px=o.uv_px[::4]) for o in outlines]
    rough = _Problem(chosen[::4], coarse, world_from_local, walls, bottom)
    tried = [rough.fitted(start, params.rough_rounds) for start in _starts(chosen, float(high[2]))]
    problem = _Problem(chosen, outlines, world_from_local, walls, bottom)
    start = min(tried, key=lambda found: found[1])[0]
    if rough.median_distance(start) > params.no_box_m:
        return None
    best, cost = problem.fitted(start, params.rounds)
    sizes = np.array([best[2] - best[1], best[4] - best[3], best[5] - low[2]])
    if (sizes < 0.005).any():
        return None
    rotation = rotation_about_z(float(best[0]))
    middle = np.array([best[1] + best[2], best[3] + best[4], best[5] + low[2]]) / 2
    seen, known = problem.size_sigma(best, (_WALL_ROW, _USUAL_ROW)), problem.size_sigma(best, ())
    return Cuboid(world_from_local @ Rigid3(rotation, rotation @ middle), sizes, seen, float(known[1]), cost)


def _starts(points: Points, top_m: float) -> list[np.ndarray]:
    """Initial boxes of several depths, along the frame and along the points' own smallest rectangle."""
    params = tuned(Params)
    own = (upright_box(points, trim=0.01).yaw_rad + np.pi / 4) % (np.pi / 2) - np.pi / 4
    starts = []
    for yaw in (0.0, own) if abs(own) > params.same_yaw_rad else (0.0,):
        turned = points @ rotation_about_z(yaw)
        start, end = np.quantile(turned, 0.01, axis=0), np.quantile(turned, 0.99, axis=0)
        for share in params.starts:
            starts.append(np.array([yaw, start[0], end[0], start[1], start[1] + share * (end[0] - start[0]), top_m]))
    return starts


def surface_distance(cuboid: Cuboid, points_world: Points) -> np.ndarray:
    """Signed distance of points to the box's surface, positive outside."""
    return _box_distance(cuboid.world_from_cuboid.inverse.apply(points_world), np.asarray(cuboid.size_m) / 2)


def room_behind(cuboid: Cuboid, walls: Sequence[Wall]) -> float:
    """Free depth behind the box before its back meets a wall, metres; infinite without a wall behind it."""
    params = tuned(Params)
    corners = cuboid.world_from_cuboid.apply(box_corners(cuboid.size_m))
    into = cuboid.world_from_cuboid.rotation[:, 1]
    free = [
        (float((corners @ wall.normal).min() - wall.offset_m) + params.wall_m) / float(-wall.normal @ into)
        for wall in walls
        if wall.normal @ into < -0.1
    ]
    return max(min(free, default=np.inf), 0.0)


class _Problem:
    """Residuals and weights of a box (yaw, left, right, front, back, top; local frame)."""

    def __init__(
        self,
        points: Points,
        outlines: list[_Outline],
        world_from_local: Rigid3,
        walls: Sequence[Wall],
        bottom_m: float,
    ) -> None:
        params = tuned(Params)
        self._points, self._outlines, self._bottom_m = points, outlines, bottom_m
        self._cameras = [o.view.world_from_camera.inverse @ world_from_local for o in outlines]
        local_from_world = world_from_local.inverse
        self._walls = [
            (local_from_world.rotation @ wall.normal, float(wall.offset_m - wall.normal @ world_from_local.translation))
            for wall in walls
        ]
        counts = [len(o.uv_px) for o in outlines]
        depth = np.full(len(points), params.independent * len(outlines) / max(len(points), 1) / params.depth_m**2)
        outline = [np.full(n, params.independent / n / params.outline_m**2) for n in counts]
        self._weights = np.concatenate([depth, *outline, [1.0 / params.wall_m**2, 1.0 / _YAW_RAD**2, 1.0]])
        scales = np.repeat(
            [params.robust * params.depth_m, params.robust * params.outline_m, np.inf], [len(points), sum(counts), 3]
        )
        self._scales: np.ndarray = scales

    def fitted(self, start: np.ndarray, rounds: int) -> tuple[np.ndarray, float]:
        """Minimiser of the robust cost from `start` (Cauchy kernel, trust region), and its cost."""
        from scipy.optimize import least_squares

        sigma = self._weights**-0.5
        solved = least_squares(
            lambda parameters: self._residuals(parameters) / sigma,
            start,
            loss=cauchy_loss(self._scales / sigma),
            max_nfev=rounds,
        )
        return solved.x, 2.0 * float(solved.cost)

    def median_distance(self, parameters: np.ndarray) -> float:
        """Median distance of the depth points from the box's surface, metres."""
        return float(np.median(np.abs(self._residuals(parameters)[: len(self._points)])))

    def size_sigma(self, parameters: np.ndarray, left_out: tuple[int, ...]) -> Vector3:
        """Standard deviation of width, depth and height from the curvature at the fit, with some rows left out."""
        residual = self._residuals(parameters)
        slope = self._slope(parameters, residual)
        weight = self._weights * cauchy(residual, self._scales)
        weight[list(left_out)] = 0.0
        covariance = np.linalg.pinv(slope.T @ (slope * weight[:, None]) + 1e-3 * np.eye(6))
        difference = np.array([[0, -1, 1, 0, 0, 0], [0, 0, 0, -1, 1, 0], [0, 0, 0, 0, 0, 1]], dtype=np.float64)
        return np.asarray(np.sqrt(np.diag(difference @ covariance @ difference.T)))

    def _slope(self, parameters: np.ndarray, residual: np.ndarray) -> np.ndarray:
        step = 1e-4
        columns = [(self._residuals(parameters + step * np.eye(6)[k]) - residual) / step for k in range(6)]
        return np.stack(columns, axis=1)

    def _residuals(self, parameters: np.ndarray) -> np.ndarray:
        params = tuned(Params)
        yaw, left, right, front, back, top = parameters
        rotation = rotation_about_z(float(yaw))
        low, high = np.array([left, front, self._bottom_m]), np.array([right, back, top])
        half, middle = (high - low) / 2, (high + low) / 2
        off = _box_distance(self._points @ rotation - middle, half)
        corners = (box_corners(high - low) + middle) @ rotation.T
        outline = [_outline_residual(camera.apply(corners), o) for camera, o in zip(self._cameras, self._outlines, strict=True)]
        inside = [min(float((corners @ normal).min() - offset), 0.0) for normal, offset in self._walls]
        width = max(right - left, 1e-3)
        usual = (back - front - params.usual_depth * width) / (params.depth_spread * width)
        return np.concatenate([off, *outline, [min(inside, default=0.0), yaw, usual]])


def _box_distance(points: Points, half: np.ndarray) -> np.ndarray:
    """Signed distance to a centred box."""
    beyond = np.abs(points) - half
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0))


def _outline_residual(corners_camera: Points, outline: _Outline) -> np.ndarray:
    """Signed distance (m) of outline pixels from the corners' silhouette, a common shift of the frame projected out."""
    params = tuned(Params)
    if corners_camera[:, 2].min() < 0.05:
        return np.full(len(outline.uv_px), 1.0)
    corners = project(corners_camera, outline.view.rgb_camera)
    hull = cv2.convexHull(corners.astype(np.float32)).reshape(-1, 2).astype(np.float64)
    along = np.roll(hull, -1, axis=0) - hull
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
    normals *= np.sign(((hull - hull.mean(axis=0)) * normals).sum()) or 1.0
    distance = outline.uv_px @ normals.T - (hull * normals).sum(axis=1)
    edge = np.argmax(distance, axis=1)
    off = distance[np.arange(len(edge)), edge] * outline.metres_per_px
    across = normals[edge]
    share = params.outline_m**2 * len(off) / params.independent / params.shift_m**2
    shift = np.linalg.solve(across.T @ across + share * np.eye(2), across.T @ np.clip(off, -0.02, 0.02))
    return np.asarray(off - across @ shift)


def _own_outline(view: View) -> _Outline | None:
    """Outline pixels away from the photo's border and from occluders; None if too few."""
    params = tuned(Params)
    contours, _ = cv2.findContours(view.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    contour = max(contours, key=len).reshape(-1, 2).astype(np.float64)
    if len(contour) < 40:
        return None
    following, before = np.roll(contour, -4, axis=0), np.roll(contour, 4, axis=0)
    along = following - before
    out = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
    out *= np.sign(((contour - contour.mean(axis=0)) * out).sum()) or 1.0
    edge = contour + 0.5 + 0.5 * out  # contours run through the centres of the outermost pixels
    reach = params.along_px * view.rgb_camera.fx / view.depth_camera.fx
    inner, outer = (_depth_at(view, edge + sign * reach * out) for sign in (-1.0, 1.0))
    own = inner[inner > 0]
    if len(own) < 10:
        return None
    inner = np.where(inner > 0, inner, np.median(own))
    blocked = (outer > 0) & (outer < inner - params.before_m)
    height, width = view.mask.shape
    border = (contour < 2).any(axis=1) | (contour[:, 0] > width - 3) | (contour[:, 1] > height - 3)
    kept = np.flatnonzero(~blocked & ~border)
    if len(kept) < 30:
        return None
    kept = kept[:: max(len(kept) // params.outline_samples, 1)]
    return _Outline(view, edge[kept], float(np.median(own)) / view.rgb_camera.fx)


def _depth_at(view: View, uv_px: np.ndarray) -> np.ndarray:
    """Measured depth at pixels of the colour crop; 0 where unknown."""
    rays = unproject(uv_px, np.ones(len(uv_px)), view.rgb_camera)
    values, inside = sample_nearest(view.depth_m, project(rays, view.depth_camera))
    return np.where(inside, values, 0.0)
