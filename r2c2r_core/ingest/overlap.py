"""Overlap and disagreement of frames: downscaled depth views with normals, matched by projection."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Points
from r2c2r_core.geometry.camera import Intrinsics, depth_points, project, sample_nearest, unproject
from r2c2r_core.geometry.least_squares import geman_mcclure
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of depth view comparison."""

    width_px: int = param(
        128,
        "px",
        "Approximate width of a downscaled view",
        source="a normal needs several LiDAR pixels, and a thousand points fix a pose",
        ge=16,
    )
    matched: int = param(1200, "count", "Maximum number of points of a view that are matched to another", ge=10)
    probes: int = param(80, "count", "Minimum number of points that measure the overlap of two views", ge=4)
    normal_cos: float = param(
        float(np.cos(np.radians(35.0))),
        "cosine",
        "Cosine of the angle between two matched normals above which they agree (35 degrees)",
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmallView:
    """A downscaled, smoothed depth image with normals, in its camera's frame."""

    camera: Intrinsics
    depth_m: DepthMetres  # 0 where unknown
    normals: np.ndarray  # (h, w, 3) towards the camera; 0 where unknown
    points: Points  # a spread of those with a normal
    point_normals: Points


class Match(NamedTuple):
    """Point-to-plane correspondences of two views, in the world frame."""

    moved: Points  # of the first view
    still: Points  # of the second
    normals: Points  # of the second
    weights: np.ndarray  # 1 / variance (1/m^2), robust

    @property
    def gaps_m(self) -> np.ndarray:
        """Signed distance of the moved points from the other's surface."""
        return np.asarray(np.einsum("nd,nd->n", self.moved - self.still, self.normals))


def small_view(frame: Frame, images: FrameImages, far_m: float) -> SmallView:
    """The frame's depth, downscaled, with smoothed depth and normals."""
    params = tuned(Params)
    depth = images.depth(frame.index).metres
    step = max(1, round(depth.shape[1] / params.width_px))
    nearby = np.where(depth < far_m, depth, np.float32(0))
    small = _smoothed(nearby[step // 2 :: step, step // 2 :: step])
    full = frame.depth_camera
    # subsampling keeps the pixel centres of the large image: column k is column k * step + step // 2 there
    shift = 0.5 - (step // 2 + 0.5) / step
    camera = Intrinsics(
        fx=full.fx / step,
        fy=full.fy / step,
        cx=full.cx / step + shift,
        cy=full.cy / step + shift,
        width=small.shape[1],
        height=small.shape[0],
    )
    points = depth_points(small, camera)
    normals = _normals(points, small)
    usable = np.flatnonzero(normals.any(axis=2).ravel())
    chosen = usable[np.linspace(0, len(usable) - 1, min(params.matched, len(usable))).astype(int)] if len(usable) else usable
    return SmallView(
        camera=camera,
        depth_m=small,
        normals=normals,
        points=points.reshape(-1, 3)[chosen].astype(np.float64),
        point_normals=normals.reshape(-1, 3)[chosen].astype(np.float64),
    )


def overlaps(views: Sequence[SmallView], poses: Sequence[Rigid3]) -> np.ndarray:
    """Fraction (n, n) of view i's points that view j also sees, within 20 cm, under the given poses."""
    params = tuned(Params)
    shares = np.zeros((len(views), len(views)))
    inverses = [p.inverse for p in poses]
    for i, view in enumerate(views):
        if len(view.points) < params.probes:
            continue
        probes = poses[i].apply(view.points[:: len(view.points) // params.probes])
        for j, other in enumerate(views):
            if i == j:
                continue
            there = inverses[j].apply(probes)
            measured, inside = sample_nearest(other.depth_m, project(there, other.camera))
            near = np.abs(measured - there[:, 2]) < 0.20
            shares[i, j] = (inside & near & (measured > 0) & (there[:, 2] > 0.05)).mean()
    return shares


def match(first: SmallView, second: SmallView, world_from_first: Rigid3, world_from_second: Rigid3, reach_m: float) -> Match:
    """Projective point-to-plane correspondences of `first` on `second`, within `reach_m`."""
    moved = world_from_first.apply(first.points)
    there = world_from_second.inverse.apply(moved)
    uv = project(there, second.camera)
    measured, inside = sample_nearest(second.depth_m, uv)
    normals, _ = sample_nearest(second.normals, uv)
    spots = np.floor(uv) + 0.5
    with np.errstate(invalid="ignore"):
        still = unproject(spots, measured, second.camera)
        gap = np.einsum("nd,nd->n", there - still, normals)
        apart = np.linalg.norm(there - still, axis=1)
    facing = world_from_second.rotation.T @ world_from_first.rotation
    agree = np.einsum("nd,nd->n", first.point_normals @ facing.T, normals) > tuned(Params).normal_cos
    ok = inside & (measured > 0) & (there[:, 2] > 0.05) & agree & (np.abs(gap) < reach_m) & (apart < 2.0 * reach_m + 0.05)
    sigma = 0.004 + 0.002 * measured[ok] ** 2  # of fused Kinect and LiDAR depth
    robust = geman_mcclure(gap[ok], np.maximum(2.0 * sigma, 0.3 * reach_m))
    return Match(
        moved[ok], world_from_second.apply(still[ok]), world_from_second.turn(normals[ok].astype(np.float64)), robust / sigma**2
    )


class Agreement(NamedTuple):
    """Agreement of two views under a relative pose."""

    seen: float  # share of the first one's points that fall on known depth of the second
    coincide: float  # share of those that lie on its surface, within 3 cm


def agreement(first: SmallView, second: SmallView, first_from_second: Rigid3) -> Agreement:
    """Fraction of the points of `first` that `second` sees, and of those that coincide with its surface."""
    if not len(first.points):
        return Agreement(0.0, 0.0)
    there = first_from_second.inverse.apply(first.points)
    measured, inside = sample_nearest(second.depth_m, project(there, second.camera))
    seen = int((inside & (measured > 0) & (there[:, 2] > 0.05)).sum())
    found = match(first, second, Rigid3(), first_from_second, 0.03)
    return Agreement(seen / len(first.points), len(found.weights) / seen if seen >= 100 else 0.0)


def _smoothed(depth_m: DepthMetres) -> DepthMetres:
    """Depth smoothed by a bilateral filter; unknown pixels stay unknown."""
    wide = np.where(depth_m > 0, depth_m, np.float32(-10))  # farther from every depth than the filter reaches
    smooth = cv2.bilateralFilter(wide.astype(np.float32), 7, 0.05, 1.7)
    return np.where(depth_m > 0, smooth, np.float32(0))


def _normals(points: np.ndarray, depth_m: DepthMetres, radius: int = 2) -> np.ndarray:
    """Unit normals (h, w, 3) towards the camera by central differences; 0 next to steps and unknown pixels."""
    normals = np.zeros_like(points)
    inner = slice(radius, -radius)
    left, right = points[inner, : -2 * radius], points[inner, 2 * radius :]
    above, below = points[: -2 * radius, inner], points[2 * radius :, inner]
    cross = np.cross(below - above, right - left)
    length = np.linalg.norm(cross, axis=2)
    kernel = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    low, high = cv2.erode(depth_m, kernel)[inner, inner], cv2.dilate(depth_m, kernel)[inner, inner]
    centre = depth_m[inner, inner]
    smooth = (low > 0) & (high - low < 0.06 * centre + 0.02) & (length > 0)
    unit = cross / np.maximum(length, 1e-12)[..., None]
    ray = points[inner, inner]
    steep = np.abs(np.einsum("hwd,hwd->hw", unit, ray)) < 0.17 * np.linalg.norm(ray, axis=2)  # seen at less than 10 deg
    normals[inner, inner] = np.where((smooth & ~steep)[..., None], unit, 0.0)
    return normals
