"""Stable standing directions of a mesh: of two poses that fit equally well, the one that would topple is wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from r2c2r_core.arrays import Matrix3, Points, Vector3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of stable standing."""

    touching: tuple[float, float, float] = param(
        (0.03, 0.02, 0.02),
        "ratio",
        "Height of the contact zone relative to the diameter, pass by pass",
        source="generated bases are bumpy",
    )
    flat: float = param(
        1 / 9, "ratio", "Maximum ratio of the contact zone's thickness to its width: an object rocks on a round side"
    )
    settled_deg: float = param(
        12.0, "deg", "Maximum angle between a direction and its base's normal: beyond it, it belongs to another base"
    )
    most: int = param(14, "count", "Maximum number of directions", ge=1)
    sides: int = param(
        8, "count", "Maximum number of them from flat sides of the hull: a mug's base is among its smaller ones", ge=1
    )


def standing_directions(
    points: Points, frames: tuple[Matrix3, ...], boxiness: float, sides: Sequence[Vector3]
) -> tuple[tuple[Vector3, ...], tuple[Vector3, ...]]:
    """Directions that may point up (stable ones first, at least 10 degrees apart), and the stable ones of them.

    They come from the box axes and the flat `sides` of the hull, outward normals, largest first. A box's own axes are
    determined by all of its sides; anything else stands perpendicular to its base, from which its box axes deviate by some
    degrees where a handle sticks out.
    """
    params = tuned(Params)
    axes = [sign * frame[:, k] for frame in frames for k in range(3) for sign in (1.0, -1.0)]
    downs = [-n for n in sides[: params.sides]]
    own, others = (axes[:6], [*downs, *axes[6:]]) if boxiness > 0.5 else ([], [*downs, *axes])
    stable: list[Vector3] = []
    rest: list[Vector3] = []
    for direction in own:
        _add(stable if _carries(_foot(points, direction, params.touching[-1]), points, direction) else rest, direction)
    for direction in others:
        settled = settled_on_base(points, direction)
        _add(rest if settled is None else stable, direction if settled is None else settled)
    ups = list(stable)
    for direction in rest:
        _add(ups, direction)
    return tuple(ups[: params.most]), tuple(stable[: params.most])


def settled_on_base(points: Points, up: Vector3) -> Vector3 | None:
    """`up` made normal to the side on which `points` (an even sample) would rest; None if they would topple or rock."""
    params = tuned(Params)
    start = up
    for touching in params.touching:
        foot = _foot(points, up, touching)
        if len(foot) < 12:
            return None
        _, (_, width, thickness), axes = np.linalg.svd(foot - foot.mean(axis=0), full_matrices=False)
        up = axes[2] * np.sign(axes[2] @ up)
        if up @ start < np.cos(np.radians(params.settled_deg)):
            return None
    return up if thickness < params.flat * width and _carries(foot, points, up) else None


def hull_directions(points: Points, count: int) -> list[Vector3]:
    """Outward normals of the largest flat sides of the convex hull, largest first, at least 5 degrees apart."""
    try:
        hull = ConvexHull(points)
    except QhullError:
        return []
    corners = points[hull.simplices]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    normals = hull.equations[:, :3]
    left = area.copy()
    found: list[np.ndarray] = []
    together = normals @ normals.T > np.cos(np.radians(5))
    gathered = together @ left
    while len(found) < count:
        k = int(np.argmax(gathered))
        if gathered[k] < 0.01 * area.sum():
            break
        side = np.flatnonzero(together[k] & (left > 0))
        direction = left[side] @ normals[side]
        found.append(direction / np.linalg.norm(direction))
        gathered -= left[side] @ together[side]
        left[side] = 0.0
    return found


def _foot(points: Points, up: Vector3, touching: float) -> Points:
    """Contact points: the lowest, up to that fraction of the size above the lowest half percent (ignoring single spikes)."""
    height = points @ up
    return points[height < np.quantile(height, 0.005) + touching * float(np.linalg.norm(np.ptp(points, axis=0)))]


def _carries(foot: Points, points: Points, up: Vector3) -> bool:
    """Whether the mean of the points lies above the contact polygon."""
    plan = np.linalg.svd(up[None])[2][1:]
    try:
        outline = ConvexHull(foot @ plan.T)
    except QhullError:
        return False
    return bool((outline.equations[:, :2] @ (plan @ points.mean(axis=0)) + outline.equations[:, 2] < 0).all())


def _add(directions: list[Vector3], new: Vector3) -> None:
    """Append a direction unless one within 10 degrees is already there."""
    if all(new @ known < np.cos(np.radians(10)) for known in directions):
        directions.append(new)
