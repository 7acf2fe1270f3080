"""How much of what a joint opens is really free: a door before a solid block opens onto nothing."""

from typing import Any

import numpy as np

from r2c2r_core.arrays import Points

_WALL_M = 0.03  # walls, fronts and floors of furniture and of ovens end within this of the outside
_STEP_M = 0.02
_LEAST_INSIDE_M = 0.06


def cavity_open(model: Any, joint: str) -> float | None:
    """Share (0..1) of the space inside that no collider fills; None where nothing is big enough to hold anything.

    A hinge opens the body it hangs on, a slide carries its own tray.
    """
    import mujoco

    entry = model.joint(joint)
    moving = int(entry.bodyid[0])
    body = moving if int(entry.type[0]) == int(mujoco.mjtJoint.mjJNT_SLIDE) else int(model.body_parentid[moving])
    solids = [_corners_and_planes(model, g) for g in range(model.ngeom) if int(model.geom_bodyid[g]) == body and body != 0]
    if not solids:
        return None
    corners = np.concatenate([corners for corners, _ in solids])
    low, high = corners.min(axis=0) + _WALL_M, corners.max(axis=0) - _WALL_M
    if (high - low < _LEAST_INSIDE_M).any():
        return None
    ranges = [np.arange(a, b, _STEP_M) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
    filled = np.zeros(len(points), dtype=bool)
    for _, planes in solids:
        filled |= (points @ planes[:, :3].T + planes[:, 3] < 0).all(axis=1)
    return float(1.0 - filled.mean())


def _corners_and_planes(model: Any, geom: int) -> tuple[Points, np.ndarray]:
    """Corners and outward planes (n, 4) of a convex collider, in its body's frame."""
    import mujoco
    from scipy.spatial import ConvexHull

    if int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_MESH):
        mesh = int(model.geom_dataid[geom])
        start = int(model.mesh_vertadr[mesh])
        own = model.mesh_vert[start : start + int(model.mesh_vertnum[mesh])].astype(np.float64)
    else:
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        own = signs * model.geom_size[geom]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    corners = own @ turn.reshape(3, 3).T + model.geom_pos[geom]
    return corners, ConvexHull(corners).equations
