"""Depth agreement of frame pairs that see the same surface: the measure behind all other findings.

Arrays are stacked, so that testing another convention, scale or calibration on all pairs at once takes milliseconds.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Integer

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.tuning import param, tuned

_NEAR_M = 0.05

Rotations = Float[np.ndarray, "views 3 3"]
Centres = Float[np.ndarray, "views 3"]
Pairs = Integer[np.ndarray, "pairs 2"]  # positions of the view whose points are taken and of the view they are compared with


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of pairwise comparison."""

    width_px: int = param(160, "px", "Minimum width of a subsampled depth image", ge=16)
    points: int = param(700, "count", "Maximum number of points of each view", ge=30)
    noise: tuple[float, float] = param(
        (0.01, 0.01), "m", "Tolerance between two depths of one surface: at 0 m, and increase per metre"
    )
    hidden: tuple[float, float] = param(
        (0.1, 0.1), "m", "Depth difference above which a point is occluded in one view: at 0 m, and increase per metre"
    )
    cut: float = param(3.0, "ratio", "Truncation of a disagreement, in tolerances")
    least_points: int = param(30, "count", "Minimum number of points that both views see")
    moved_m: float = param(0.15, "m", "Camera translation above which a later view becomes the neighbour")
    turned_deg: float = param(8.0, "deg", "Camera rotation above which a later view becomes the neighbour")
    later: int = param(6, "count", "Maximum number of later views searched; the last is taken if none has moved enough", ge=1)
    overlap: float = param(0.2, "share", "Minimum overlap of a wide-baseline pair")
    parallax: float = param(0.1, "ratio", "Minimum ratio of baseline to distance of a wide-baseline pair")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Views:
    """Frames of a recording, subsampled and stacked; lengths in metres, pixels of the subsampled depth images."""

    position: Integer[np.ndarray, " views"]  # in the capture's list of frames
    depth_m: Float[np.ndarray, "views rows columns"]
    focal: Float[np.ndarray, "views 2"]
    centre: Float[np.ndarray, "views 2"]
    rotation: Rotations  # world_from_camera
    translation: Centres
    point_uv: Float[np.ndarray, "views points 2"]  # pixels of known depth, spread over the image
    point_z: Float[np.ndarray, "views points"]  # 0 where a view has fewer points

    def camera(self, view: int) -> Intrinsics:
        """The camera of a view's subsampled depth image."""
        (fx, fy), (cx, cy), (rows, columns) = self.focal[view], self.centre[view], self.depth_m.shape[1:]
        return Intrinsics(fx=float(fx), fy=float(fy), cx=float(cx), cy=float(cy), width=columns, height=rows)

    def world_from_camera(self, view: int) -> Rigid3:
        """The pose of a view."""
        return Rigid3(self.rotation[view], self.translation[view])

    def posed(self, rotation: Rotations, translation: Centres) -> "Views":
        """The same images with other poses."""
        return replace(self, rotation=rotation, translation=translation)


class Disagreement(NamedTuple):
    """Differences between measured and predicted depth of one view's points in the other view, with validity."""

    apart_m: Float[np.ndarray, "pairs points"]
    expected_m: Float[np.ndarray, "pairs points"]  # depth at which the other view should see the point
    seen: Bool[np.ndarray, "pairs points"]  # in the other's image, and known there
    known: Bool[np.ndarray, "pairs points"]  # the first view has a point at all
    row: Integer[np.ndarray, "pairs points"]  # the pixel of the second view; 0 where outside
    column: Integer[np.ndarray, "pairs points"]

    @property
    def agrees(self) -> np.ndarray:
        """Points on which both views agree within the depth tolerance."""
        return self.seen & (np.abs(self.apart_m) < tolerance_m(self.expected_m))

    @property
    def agreement(self) -> np.ndarray:
        """Fraction (pairs,) of the first view's points that the second confirms."""
        return np.asarray(self.agrees.sum(axis=1) / np.maximum(self.known.sum(axis=1), 1))

    @property
    def comparable(self) -> np.ndarray:
        """Points that both views see: larger differences mean occlusion in one of the two."""
        least, more = tuned(Params).hidden
        return self.seen & (np.abs(self.apart_m) < least + more * self.expected_m)

    @property
    def overlap(self) -> np.ndarray:
        """Fraction (pairs,) of the first view's points that the second sees at roughly their distance."""
        return np.asarray(self.comparable.sum(axis=1) / np.maximum(self.known.sum(axis=1), 1))

    @property
    def error_m(self) -> np.ndarray:
        """Median disagreement (pairs,) in metres over comparable points; NaN with too few."""
        comparable = self.comparable
        errors = np.full(len(comparable), np.nan)
        for k in np.flatnonzero(comparable.sum(axis=1) >= tuned(Params).least_points):
            errors[k] = np.median(np.abs(self.apart_m[k, comparable[k]]))
        return errors

    @property
    def cost(self) -> np.ndarray:
        """Mean truncated disagreement (pairs,) in tolerances, over points both see; the truncation value with too few."""
        comparable = self.comparable
        counts = comparable.sum(axis=1)
        params = tuned(Params)
        cut = np.minimum(np.abs(self.apart_m) / tolerance_m(self.expected_m), params.cut)
        mean = np.where(comparable, cut, 0.0).sum(axis=1) / np.maximum(counts, 1)
        return np.where(counts >= params.least_points, mean, params.cut)


def tolerance_m(depth_m: np.ndarray) -> np.ndarray:
    """Tolerance between two depth images at a depth: 2 cm at 1 m, 4 cm at 3 m."""
    least, more = tuned(Params).noise
    return np.asarray(least + more * depth_m)


def stack_views(frames: Sequence[Frame], images: FrameImages, positions: Sequence[int], rng: np.random.Generator) -> Views:
    """The frames at those positions, subsampled; all must have depth images of one size."""
    parts = [_thinned(frames[p], images, rng) for p in positions]
    return Views(
        position=np.asarray(positions, dtype=np.int64),
        depth_m=np.stack([part[0] for part in parts]),
        focal=np.array([part[1] for part in parts]),
        centre=np.array([part[2] for part in parts]),
        rotation=np.stack([frames[p].world_from_camera.rotation for p in positions]),
        translation=np.stack([frames[p].world_from_camera.translation for p in positions]),
        point_uv=np.stack([part[3] for part in parts]),
        point_z=np.stack([part[4] for part in parts]),
    )


def compare(
    views: Views, pairs: Pairs, *, depth_scale: float = 1.0, focal_scale: float = 1.0, along_ray: bool = False
) -> Disagreement:
    """Disagreement of each pair's depth, with depth and focal length multiplied by the given scales.

    `along_ray`: the depth images hold distances from the camera instead of along its axis.
    """
    first, second = pairs[:, 0], pairs[:, 1]
    focal = views.focal * focal_scale
    uv, z = views.point_uv[first], views.point_z[first] * depth_scale
    rays = np.concatenate([(uv - views.centre[first, None]) / focal[first, None], np.ones((*z.shape, 1))], axis=2)
    if along_ray:
        z = z / np.linalg.norm(rays, axis=2)
    rotation = np.swapaxes(views.rotation[second], 1, 2) @ views.rotation[first]
    moved = np.einsum("pji,pj->pi", views.rotation[second], views.translation[first] - views.translation[second])
    there = (rays * z[..., None]) @ np.swapaxes(rotation, 1, 2) + moved[:, None]
    depth = np.maximum(there[..., 2], _NEAR_M)
    seen_uv = there[..., :2] / depth[..., None] * focal[second, None] + views.centre[second, None]
    rows, columns = views.depth_m.shape[1:]
    u, v = seen_uv[..., 0], seen_uv[..., 1]
    inside = (there[..., 2] > _NEAR_M) & (u >= 0) & (v >= 0) & (u < columns) & (v < rows)
    column, row = np.where(inside, u, 0).astype(np.int64), np.where(inside, v, 0).astype(np.int64)
    measured = views.depth_m[second[:, None], row, column] * depth_scale
    if along_ray:
        off = (np.stack([column, row], axis=2) + 0.5 - views.centre[second, None]) / focal[second, None]
        measured = measured / np.sqrt(1.0 + (off**2).sum(axis=2))
    known = z > 0
    return Disagreement(
        apart_m=there[..., 2] - measured,
        expected_m=depth,
        seen=known & inside & (measured > 0),
        known=known,
        row=row,
        column=column,
    )


def neighbours(views: Views) -> Pairs:
    """Pairs of each view with the first later one that has moved or turned enough, else the last of a few.

    The choice by frame order and relative angles is invariant to inverted poses, flipped camera axes and reordered
    quaternions, so the pairs overlap even where the poses are wrong.
    """
    params, pairs = tuned(Params), []
    for k in range(len(views.position) - 1):
        for later in range(k + 1, min(k + 1 + params.later, len(views.position))):
            moved = float(np.linalg.norm(views.translation[later] - views.translation[k]))
            if moved > params.moved_m or angle_deg(views.rotation[k], views.rotation[later]) > params.turned_deg:
                break
        pairs.append((k, later))
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def far_pairs(views: Views, most: int) -> Pairs:
    """Wide-baseline pairs that see the same surface under the given poses, which determine scale and focal length.

    Pairs near in time are preferred: over a long time, drift looks like scale.
    """
    every, overlap = overlaps(views)
    known = np.where(views.point_z > 0, views.point_z, np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a view without depth: its overlap is 0
        distance = np.nan_to_num(np.nanmedian(known, axis=1), nan=1.0)
    apart = np.linalg.norm(views.translation[every[:, 0]] - views.translation[every[:, 1]], axis=1)
    parallax = apart / np.maximum(distance[every[:, 0]], 0.3)
    soon = 1.0 / (1.0 + ((every[:, 1] - every[:, 0]) / (0.15 * len(views.position))) ** 2)
    wanted = np.where(
        (overlap > tuned(Params).overlap) & (parallax > tuned(Params).parallax),
        np.minimum(parallax, 0.8) * np.sqrt(overlap) * soon,
        0.0,
    )
    return spread(every, wanted, most)


def overlaps(views: Views) -> tuple[Pairs, np.ndarray]:
    """All ordered pairs of views, and the fraction of the first's points that the second sees at roughly their distance."""
    count = len(views.position)
    first, second = np.nonzero(~np.eye(count, dtype=bool))
    every = np.stack([first, second], axis=1)
    few = replace(views, point_uv=views.point_uv[:, ::12], point_z=views.point_z[:, ::12])
    shares = [np.zeros(0)]
    for chunk in np.array_split(every, max(1, len(every) // 400)):
        shares.append(compare(few, chunk).overlap)
    return every, np.concatenate(shares)


def spread(pairs: Pairs, wanted: np.ndarray, most: int) -> Pairs:
    """The highest-scoring pairs, with no view in more than a few of them."""
    views = int(pairs.max()) + 1 if len(pairs) else 1
    uses, limit = np.zeros(views, dtype=np.int64), max(2, -(-3 * most // views))
    chosen: list[np.ndarray] = []
    for k in np.argsort(-wanted, kind="stable"):
        if wanted[k] <= 0 or len(chosen) == most:
            break
        if (uses[pairs[k]] < limit).all():
            chosen.append(pairs[k])
            uses[pairs[k]] += 1
    return np.array(chosen, dtype=np.int64).reshape(-1, 2)


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    """Angle between two rotations (3, 3), degrees."""
    return float(np.degrees(np.arccos(np.clip((np.trace(a.T @ b) - 1.0) / 2.0, -1.0, 1.0))))


def _thinned(
    frame: Frame, images: FrameImages, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(depth, focal lengths, principal point, pixels of some known points, their depth) at a fraction of the resolution."""
    params, camera = tuned(Params), frame.depth_camera
    step = max(1, camera.width // params.width_px)
    start = step // 2  # subsampled pixel k is the full one at start + k * step, whose centre lies half a pixel further
    depth = np.asarray(images.depth(frame.index).metres[start::step, start::step])
    off_centre = (start + 0.5) / step - 0.5
    focal = np.array([camera.fx, camera.fy]) / step
    centre = np.array([camera.cx, camera.cy]) / step - off_centre
    row, column = np.nonzero(depth > 0)
    taken = rng.permutation(len(row))[: params.points]
    uv, z = np.zeros((params.points, 2)), np.zeros(params.points)
    uv[: len(taken)] = np.stack([column[taken], row[taken]], axis=1) + 0.5
    z[: len(taken)] = depth[row[taken], column[taken]]
    return depth, focal, centre, uv, z
