"""Whether a thing would stay as it was found: its centre of mass lies over what it stands on."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What touches the ground."""

    touching_m: float = param(0.015, "m", "above the lowest point, within which a vertex is a foot")


def stands(vertices: Points, faces: Faces) -> bool:
    """Whether a closed mesh of one density (metres, +Z up) rests on its lowest points without tipping."""
    from scipy.spatial import Delaunay, QhullError

    feet = vertices[vertices[:, 2] < vertices[:, 2].min() + tuned(Params).touching_m, :2]
    try:
        return bool(Delaunay(np.unique(feet, axis=0)).find_simplex(_centre_of_mass(vertices, faces)[:2]) >= 0)
    except (QhullError, ValueError):  # a point or a line of feet
        return False


def _centre_of_mass(vertices: Points, faces: Faces) -> np.ndarray:
    """Of a closed mesh: the sum over the tetrahedra from its middle to every face."""
    middle = vertices.mean(axis=0)
    a, b, c = (vertices[faces[:, k]] - middle for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    return np.asarray(middle + (volumes[:, None] * (a + b + c)).sum(axis=0) / (4.0 * volumes.sum()))
