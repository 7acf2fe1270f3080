"""Free fraction of the cavity behind a door or drawer, to detect doors in front of solid colliders."""

from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.boxes import box_corners

_WALL_M = 0.03  # maximum thickness of walls, fronts and floors of furniture and ovens
_WALL_ZONE_M = 0.12  # a plate this near to the outside is a wall, such as a refrigerator's of 8 cm or a recessed back panel
_STEP_M = 0.02
_LEAST_INSIDE_M = 0.06


class _Solid(NamedTuple):
    """A convex collider in the leaf's frame."""

    corners: Points
    planes: np.ndarray  # (n, 4), outward


def cavity_open(model: Any, joint: str) -> float | None:
    """Fraction (0..1) of the space behind a leaf that no collider fills; None if the space is too small to hold anything.

    A hinge opens its parent body, a slide carries its own tray. The leaf is the moving body's front board: parts beside
    it, such as a microwave's electronics, do not belong to the space it opens.
    """
    import mujoco

    entry = model.joint(joint)
    moving = int(entry.bodyid[0])
    slides = int(entry.type[0]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
    body = moving if slides else int(model.body_parentid[moving])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    axis_world = data.xaxis[int(entry.id)]
    leaf = _leaf(model, data, moving, axis_world if slides else None)
    if leaf is None or body == 0:
        return None
    solids = [_solid(model, data, g, leaf) for g in range(model.ngeom) if int(model.geom_bodyid[g]) == body and g != leaf]
    centre, half = model.geom_aabb[leaf][:3], model.geom_aabb[leaf][3:]
    outward = data.geom_xmat[leaf].reshape(3, 3).T @ axis_world
    inner = [solid for solid in solids if not (slides and _before(solid, centre, outward))]
    if not inner:
        return None
    front = [centre + box_corners(2 * half)] if slides else []  # a tray is open above its sides, up to its front's top
    low, high = _between_walls([*front, *(solid.corners for solid in inner)])
    across = np.arange(3) != int(np.argmin(half))
    low[across] = np.maximum(low, centre - half + _WALL_M)[across]
    high[across] = np.minimum(high, centre + half - _WALL_M)[across]
    return _free_share(low, high, inner)


def _between_walls(solids: list[Points]) -> tuple[Vector3, Vector3]:
    """Low and high corner of the inner space: the bounds of all solids up to the inner faces of the plates near them."""
    lows, highs = np.array([s.min(axis=0) for s in solids]), np.array([s.max(axis=0) for s in solids])
    thick = highs - lows
    low, high = lows.min(axis=0), highs.max(axis=0)
    across = thick == thick.min(axis=1, keepdims=True)  # the direction of each plate's normal
    zone = np.minimum(_WALL_ZONE_M, (high - low) / 2)
    below = np.where(across & (highs < low + zone), highs - low, 0.0).max(axis=0)
    above = np.where(across & (lows > high - zone), high - lows, 0.0).max(axis=0)
    return low + np.maximum(below, _WALL_M), high - np.maximum(above, _WALL_M)


def _free_share(low: Vector3, high: Vector3, solids: list[_Solid]) -> float | None:
    if (high - low < _LEAST_INSIDE_M).any():
        return None
    ranges = [np.arange(a, b, _STEP_M) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
    filled = np.zeros(len(points), dtype=bool)
    for _, planes in solids:
        filled |= (points @ planes[:, :3].T + planes[:, 3] < 0).all(axis=1)
    return float(1.0 - filled.mean())


def _leaf(model: Any, data: Any, moving: int, outward_world: Vector3 | None) -> int | None:
    """The collider of a moving body with the largest face; for a drawer, the largest seen along its sliding direction."""

    def face(geom: int) -> float:
        size = model.geom_aabb[geom][3:]
        if outward_world is None:
            return float(np.prod(np.sort(size)[1:]))
        along = np.argmax(np.abs(data.geom_xmat[geom].reshape(3, 3).T @ outward_world))
        return float(np.prod(np.delete(size, along)))

    return max((g for g in range(model.ngeom) if int(model.geom_bodyid[g]) == moving), key=face, default=None)


def _before(solid: _Solid, middle: Vector3, outward: Vector3) -> bool:
    """Whether a part lies on the outer side of the leaf: a handle."""
    return bool(((solid.corners - middle) @ outward > 0).all())


def _solid(model: Any, data: Any, geom: int, leaf: int) -> _Solid:
    """A collider's corners and planes in the leaf's frame."""
    import mujoco
    from scipy.spatial import ConvexHull

    if int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_MESH):
        mesh = int(model.geom_dataid[geom])
        start = int(model.mesh_vertadr[mesh])
        own = model.mesh_vert[start : start + int(model.mesh_vertnum[mesh])].astype(np.float64)
    else:
        own = box_corners(2 * model.geom_size[geom])
    world = own @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    corners = (world - data.geom_xpos[leaf]) @ data.geom_xmat[leaf].reshape(3, 3)
    return _Solid(corners, ConvexHull(corners).equations)
