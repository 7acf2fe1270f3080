"""Static stability test: an object rests if its centre of mass lies above its support polygon."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of ground contact."""

    touching_m: float = param(0.015, "m", "Height above the lowest point within which a vertex touches the ground")


def stands(vertices: Points, faces: Faces) -> bool:
    """Whether a closed mesh of uniform density (metres, +Z up) rests on its lowest points without tipping."""
    from scipy.spatial import Delaunay, QhullError

    feet = vertices[vertices[:, 2] < vertices[:, 2].min() + tuned(Params).touching_m, :2]
    try:
        return bool(Delaunay(np.unique(feet, axis=0)).find_simplex(_centre_of_mass(vertices, faces)[:2]) >= 0)
    except (QhullError, ValueError):  # contact in a point or a line only
        return False


def _centre_of_mass(vertices: Points, faces: Faces) -> np.ndarray:
    """Centre of mass of a closed mesh, summed over the tetrahedra from its mean vertex to every face."""
    middle = vertices.mean(axis=0)
    a, b, c = (vertices[faces[:, k]] - middle for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    return np.asarray(middle + (volumes[:, None] * (a + b + c)).sum(axis=0) / (4.0 * volumes.sum()))
