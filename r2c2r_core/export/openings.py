"""Collider-free fraction of an object's hollow: a mug whose collider is one convex hull holds nothing."""

import numpy as np
from scipy.spatial import ConvexHull

from r2c2r_core.arrays import Points
from r2c2r_core.export.reading import UrdfLink
from r2c2r_core.export.rules.files import BundleFiles
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.hollows import find_hollow

NEEDED_OPENING = 0.9


def opening_free(link: UrdfLink, files: BundleFiles) -> float | None:
    """Fraction (0..1) of the hollow of a link's visual that no collider fills; None where it has no hollow."""
    visual = next((files.mesh(s.mesh) for s in link.shapes if s.kind == "visual" and s.mesh is not None), None)
    if visual is None:
        return None
    found = find_hollow(visual.vertices, visual.faces)
    if found is None:
        return None
    hollow = found.points
    filled = np.zeros(len(hollow), dtype=bool)
    for shape in link.shapes:
        if shape.kind == "collision":
            filled |= inside_hull(hollow, shape.link_from_shape.apply(shape_corners(shape.box_m, shape.mesh, files)))
    return float(1.0 - filled.mean())


def shape_corners(box_m: np.ndarray | None, mesh: str | None, files: BundleFiles) -> Points:
    """Corners of a box or vertices of a mesh, in the shape's frame; empty if unreadable."""
    if box_m is not None:
        return box_corners(box_m)
    found = files.mesh(mesh) if mesh is not None else None
    return found.vertices if found is not None else np.zeros((0, 3))


def inside_hull(points: Points, corners: Points, deeper_m: float = 0.0) -> np.ndarray:
    """Mask (n,) of points inside the convex hull of the corners by more than `deeper_m`."""
    if len(corners) < 4:
        return np.zeros(len(points), dtype=bool)
    planes = ConvexHull(corners, qhull_options="QJ").equations
    return np.asarray((points @ planes[:, :3].T + planes[:, 3] < -deeper_m).all(axis=1))
