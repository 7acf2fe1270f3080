"""Which ways up a mesh can stand: gravity is known, so of two poses that fit alike the one that would topple is wrong."""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from r2c2r_core.arrays import Matrix3, Points, Vector3

_TOUCHING = (0.03, 0.02, 0.02)  # of the diameter counts as touching the support, pass by pass: generated bases are bumpy
_SETTLED_DEG = 12.0  # a direction farther from square to its base belongs to another base
_MOST = 14  # directions tried


def standing_directions(
    points: Points, frames: tuple[Matrix3, ...], boxiness: float
) -> tuple[tuple[Vector3, ...], tuple[Vector3, ...]]:
    """Directions that may point up (stable ones first, 10 degrees apart at least), and those of them that are stable.

    They come from the box axes and the flat sides of the hull. A box's own axes are known by all of its sides; anything
    else stands square to its base, which its box axes miss by some degrees where a handle sticks out.
    """
    axes = [sign * frame[:, k] for frame in frames for k in range(3) for sign in (1.0, -1.0)]
    sides = [-n for n in hull_directions(points, 8)]  # a mug's base is among its smaller sides
    stable: list[Vector3] = []
    rest: list[Vector3] = []
    for n, direction in enumerate([*axes[:6], *sides, *axes[6:]]):
        settled = settled_on_base(points, direction)
        boxy = n < 6 and boxiness > 0.5
        _add(rest if settled is None else stable, direction if settled is None or boxy else settled)
    ups = list(stable)
    for direction in rest:
        _add(ups, direction)
    return tuple(ups[:_MOST]), tuple(stable[:_MOST])


def settled_on_base(points: Points, up: Vector3) -> Vector3 | None:
    """`up` turned square to the side that `points` (an even sample) would rest on; None where they would topple."""
    start, diameter = up, float(np.linalg.norm(np.ptp(points, axis=0)))
    for touching in _TOUCHING:
        height = points @ up
        foot = points[height < np.quantile(height, 0.005) + touching * diameter]  # not of one spike: the lowest half percent
        if len(foot) < 12:
            return None
        normal = np.linalg.svd(foot - foot.mean(axis=0), full_matrices=False)[2][2]
        up = normal * np.sign(normal @ up)
        if up @ start < np.cos(np.radians(_SETTLED_DEG)):
            return None
    return up if _carries(foot, points.mean(axis=0), up) else None


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
    while len(found) < count:
        gathered = together @ left
        k = int(np.argmax(gathered))
        if gathered[k] < 0.01 * area.sum():
            break
        direction = (normals * (left * together[k])[:, None]).sum(axis=0)
        found.append(direction / np.linalg.norm(direction))
        left = np.where(together[k], 0.0, left)
    return found


def _carries(foot: Points, middle: Vector3, up: Vector3) -> bool:
    """Whether the middle lies above the foot's outline."""
    plan = np.linalg.svd(up[None])[2][1:]
    try:
        outline = ConvexHull(foot @ plan.T)
    except QhullError:
        return False
    return bool((outline.equations[:, :2] @ (plan @ middle) + outline.equations[:, 2] < 0).all())


def _add(directions: list[Vector3], new: Vector3) -> None:
    """Append a direction unless one within 10 degrees is there already."""
    if all(new @ known < np.cos(np.radians(10)) for known in directions):
        directions.append(new)
