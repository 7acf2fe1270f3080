"""Exact free travel of a rectangular cross-section among convex colliders, by linear programming."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.export.plan import Plan, collider_corners_world
from r2c2r_core.geometry.transforms import Rigid3

_SKIN_M = 2e-4  # mere contact does not count as collision


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solid:
    """A convex collider in the world."""

    planes: np.ndarray  # (n, 4): outward normal and offset; inside is below zero
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prism:
    """A rectangle that moves along its frame's z, from 0 to `length_m`."""

    world_from_prism: Rigid3
    half_m: tuple[float, float]  # along x and y
    length_m: float


def solids_of(plan: Plan) -> list[Solid]:
    """All colliders with joints closed, and the floor."""
    solids = [_of_points(corners) for body in plan.bodies for corners in collider_corners_world(body)]
    far = np.full(3, 1e3)
    floor = np.array([[0.0, 0.0, 1.0, -plan.floor_z_m]])
    return [*solids, Solid(planes=floor, low=-far, high=np.array([1e3, 1e3, plan.floor_z_m]))]


def free_length(prism: Prism, solids: Sequence[Solid]) -> float:
    """Distance in m until the moving rectangle meets a solid; its `length_m` where it meets none."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 1)], dtype=np.float64)
    swept = prism.world_from_prism.apply(corners * [*prism.half_m, prism.length_m])
    low, high = swept.min(axis=0), swept.max(axis=0)
    near = [solid for solid in solids if (solid.low < high).all() and (solid.high > low).all()]
    return min([prism.length_m, *(_met_at(prism, solid) for solid in near)])


def _met_at(prism: Prism, solid: Solid) -> float:
    """Lowest z of the intersection of prism and solid: a linear programme in three unknowns."""
    from scipy.optimize import linprog

    normals = solid.planes[:, :3] @ prism.world_from_prism.rotation
    offsets = solid.planes[:, 3] + solid.planes[:, :3] @ prism.world_from_prism.translation
    (x, y), length = prism.half_m, prism.length_m
    found = linprog([0, 0, 1], A_ub=normals, b_ub=-offsets - _SKIN_M, bounds=[(-x, x), (-y, y), (0, length)])
    return float(found.fun) if found.status == 0 else length


def _of_points(points: Points) -> Solid:
    from scipy.spatial import ConvexHull

    return Solid(planes=ConvexHull(points).equations, low=points.min(axis=0), high=points.max(axis=0))
