"""Depth on the faces of a box: patches of the fused surface, each assigned to a face."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.segment.appliances.edges import BACK, BOTTOM, FRONT, LEFT, RIGHT, TOP
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the assignment of surface to faces."""

    shell_m: float = param(0.05, "m", "Maximum distance of surface from the initial plane of a side or the top")
    front_shell_m: float = param(0.02, "m", "Maximum distance of surface from the initial front plane, which is known better")
    behind_m: float = param(
        0.03, "m", "Minimum distance behind the front of surface on sides and top: the fused surface is round at its edges"
    )
    facing: float = param(
        0.85, "cosine", "Minimum cosine between a face's normal and surface normals on it: fused normals scatter by 30 degrees"
    )
    patch_m: float = param(
        0.05,
        "m",
        "Side of a patch whose depth counts as one measurement",
        source="errors of fused depth are correlated over about 3 cm",
    )
    least_share: float = param(0.07, "share", "Minimum observed fraction of a face for it to be measured")
    gap_m: float = param(0.01, "m", "Minimum distance from the end of depth on the front to the end of the search", gt=0)


class Patches(NamedTuple):
    """Depth patches on faces, in the frame of the initial front (n patches)."""

    points: Points
    axis: np.ndarray  # (n,) coordinate across the face: 0, 1 or 2
    face: np.ndarray  # (n,) parameter of the box that this coordinate measures
    ends: dict[int, float]  # by LEFT, RIGHT and BACK: end of depth on the front, if within the search region, and on the sides


def patches_on(box: np.ndarray, scene: Scene, world_from_front: Rigid3) -> Patches:
    """Patches of the fused surface on a box's front, sides and top."""
    params = tuned(Params)
    low, high = box[[LEFT, FRONT, BOTTOM]], box[[RIGHT, BACK, TOP]]
    before, beyond = (
        np.array([params.shell_m, params.front_shell_m, params.shell_m]),
        np.array([params.shell_m, 0.0, params.shell_m]),
    )
    points, normals, areas = _surface_in(scene, world_from_front, low - before, high + beyond)
    x, y, z = points.T
    level = (z > low[2] + 0.02) & (z < high[2] - 0.02)
    inner = (x > low[0] + 0.01) & (x < high[0] - 0.01)
    behind = (y > box[FRONT] + params.behind_m) & (y < box[BACK])
    near = np.abs(points[:, [0, 0, 2]] - box[[LEFT, RIGHT, TOP]]) < params.shell_m
    width, depth, height = high - low
    on_front = (normals[:, 1] < -params.facing) & (np.abs(y - box[FRONT]) < params.front_shell_m) & level
    chosen = {
        FRONT: (on_front & inner, 0.0),
        LEFT: ((normals[:, 0] < -params.facing) & near[:, 0] & behind & level, depth * height),
        RIGHT: ((normals[:, 0] > params.facing) & near[:, 1] & behind & level, depth * height),
        TOP: ((normals[:, 2] > params.facing) & near[:, 2] & behind & inner, width * depth),
    }
    axes = {FRONT: 1, LEFT: 0, RIGHT: 0, TOP: 2}
    found = {
        face: _patches(points[on], areas[on], params.patch_m)
        for face, (on, size) in chosen.items()
        if areas[on].sum() > params.least_share * size and on.any()
    }
    count = [len(patches) for patches in found.values()]
    return Patches(
        np.concatenate([np.zeros((0, 3)), *found.values()]),
        np.repeat([axes[face] for face in found], count).astype(int),
        np.repeat(list(found), count).astype(int),
        _front_ends(points[on_front], box) | _rear_end([points[chosen[side][0]] for side in (LEFT, RIGHT) if side in found]),
    )


def _front_ends(points: Points, box: np.ndarray) -> dict[int, float]:
    """Left and right end of depth on the front."""
    params, ends = tuned(Params), {}
    for face, sign in ((LEFT, -1.0), (RIGHT, 1.0)):
        end = _end(points, sign * points[:, 0])
        if end < sign * float(box[face]) + params.shell_m - params.gap_m:
            ends[face] = sign * end
    return ends


def _rear_end(sides: list[Points]) -> dict[int, float]:
    """Rear end of depth on the sides, less what smeared depth may add behind them."""
    return {BACK: max(_end(points, points[:, 1]) for points in sides) - tuned(Params).shell_m} if sides else {}


def _end(points: Points, along: np.ndarray) -> float:
    """Median over rows of patches of the farthest point along an axis; infinite without points."""
    rows = np.floor(points[:, 2] / tuned(Params).patch_m).astype(int)
    return float(np.median([along[rows == row].max() for row in np.unique(rows)])) if len(points) else np.inf


def _surface_in(
    scene: Scene, world_from_front: Rigid3, low: np.ndarray, high: np.ndarray
) -> tuple[Points, np.ndarray, np.ndarray]:
    """Centroids, normals and areas of the surface triangles in a box of the front's frame."""
    parts = scene.parts
    near = parts.faces_near(world_from_front.apply((low + high)[None] / 2)[0], float(np.linalg.norm(high - low)) / 2)
    points = world_from_front.inverse.apply(parts.middles[near])
    inside = np.logical_and.reduce([(points[:, k] > low[k]) & (points[:, k] < high[k]) for k in range(3)])
    near = near[inside]
    return points[inside], parts.normals[near] @ world_from_front.rotation, parts.areas_m2[near]


def _patches(points: Points, areas: np.ndarray, patch_m: float) -> Points:
    """Area-weighted mean point of each cube of side `patch_m`."""
    cubes = np.floor(points / patch_m).astype(int)
    cubes -= cubes.min(axis=0)
    patch = np.ravel_multi_index(tuple(cubes.T), tuple(cubes.max(axis=0) + 1))
    weight = np.bincount(patch, areas)
    taken = np.bincount(patch) > 0
    return np.stack([np.bincount(patch, areas * points[:, k])[taken] for k in range(3)], axis=1) / weight[taken, None]
