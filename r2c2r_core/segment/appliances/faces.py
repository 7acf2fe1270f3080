"""Depth on the faces of a box: patches of the fused surface, each with its face."""

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
    """Which parts of the fused surface belong to which face."""

    shell_m: float = param(0.05, "m", "how far a side or the top may lie from where it is thought")
    front_shell_m: float = param(0.02, "m", "the same of the front, whose plane is known better")
    behind_m: float = param(
        0.03, "m", "sides and the top are read from here on behind the front: the fused surface is round at its edges"
    )
    facing: float = param(0.85, "cosine", "between a face and a normal on it: normals of fused depth scatter by 30 degrees")
    patch_m: float = param(
        0.05, "m", "side of a patch whose depth counts once", source="errors of fused depth go together over about 3 cm"
    )
    least_share: float = param(0.07, "share", "of a face that depth must have seen to measure anything by it")
    gap_m: float = param(0.01, "m", "by which a hole in a side is longer than a patch where the side ends", gt=0)
    least_reach_m: float = param(0.15, "m", "sides that end before this are dark, and depth has holes in them")


class Patches(NamedTuple):
    """Depth on faces, in the frame of the front as first thought (n patches)."""

    points: Points
    axis: np.ndarray  # (n,) coordinate across the face: 0, 1 or 2
    face: np.ndarray  # (n,) parameter of the box that this coordinate measures
    reach_m: float | None  # how far behind the front the sides and the top were seen without a gap
    ends: dict[int, float]  # by LEFT and RIGHT: where depth on the front ends, unless it goes on past the search region


def patches_on(box: np.ndarray, scene: Scene, world_from_front: Rigid3) -> Patches:
    """The patches of the fused surface that lie on a box's front, sides and top."""
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
    ends = [end for face, on in found.items() if face != FRONT and (end := _end(on[:, 1])) > params.least_reach_m]
    return Patches(
        np.concatenate([np.zeros((0, 3)), *found.values()]),
        np.repeat([axes[face] for face in found], count).astype(int),
        np.repeat(list(found), count).astype(int),
        max(ends, default=None),
        _front_ends(points[on_front], box),
    )


def _front_ends(points: Points, box: np.ndarray) -> dict[int, float]:
    """Left and right end of depth on the front: the median over rows of patches."""
    params, ends = tuned(Params), {}
    rows = np.floor(points[:, 2] / params.patch_m).astype(int)
    for face, sign in ((LEFT, -1.0), (RIGHT, 1.0)):
        reach = [float((sign * points[rows == row, 0]).max()) for row in np.unique(rows)]
        limit = sign * float(box[face]) + params.shell_m - params.gap_m
        if reach and np.median(reach) < limit:
            ends[face] = sign * float(np.median(reach))
    return ends


def _surface_in(
    scene: Scene, world_from_front: Rigid3, low: np.ndarray, high: np.ndarray
) -> tuple[Points, np.ndarray, np.ndarray]:
    """Middles, normals and areas of the surface's triangles in a box of the front's frame."""
    parts = scene.parts
    near = parts.faces_near(world_from_front.apply((low + high)[None] / 2)[0], float(np.linalg.norm(high - low)) / 2)
    points = world_from_front.inverse.apply(parts.middles[near])
    inside = np.logical_and.reduce([(points[:, k] > low[k]) & (points[:, k] < high[k]) for k in range(3)])
    near = near[inside]
    return points[inside], parts.normals[near] @ world_from_front.rotation, parts.areas_m2[near]


def _patches(points: Points, areas: np.ndarray, patch_m: float) -> Points:
    """The mean point of each cube of that side."""
    cubes = np.floor(points / patch_m).astype(int)
    cubes -= cubes.min(axis=0)
    patch = np.ravel_multi_index(tuple(cubes.T), tuple(cubes.max(axis=0) + 1))
    weight = np.bincount(patch, areas)
    taken = np.bincount(patch) > 0
    return np.stack([np.bincount(patch, areas * points[:, k])[taken] for k in range(3)], axis=1) / weight[taken, None]


def _end(depths: np.ndarray) -> float:
    """Where depths along a face first end."""
    params = tuned(Params)
    ordered = np.sort(depths)
    gaps = np.flatnonzero(np.diff(ordered) > params.patch_m + params.gap_m)
    return float(ordered[gaps[0] if len(gaps) else -1]) + params.patch_m / 2
