"""Triangle mesh joined from patches."""

from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.synthetic.patches import Patch


class JoinedMesh(NamedTuple):
    """Triangles in the kitchen frame; patches share no vertex."""

    vertices: Points
    faces: Faces
    patch_of_vertex: np.ndarray  # (n,) int
    unit: np.ndarray  # (n, 2) row and column in 0..1 within the patch


def join_patches(patches: list[Patch]) -> JoinedMesh:
    """One mesh of all patches, two triangles per cell."""
    vertices, faces, owner, unit, count = [], [], [], [], 0
    for index, patch in enumerate(patches):
        rows, columns = patch.grid.shape[:2]
        number = np.arange(rows * columns).reshape(rows, columns) + count
        a, b, c, d = number[:-1, :-1].ravel(), number[:-1, 1:].ravel(), number[1:, 1:].ravel(), number[1:, :-1].ravel()
        vertices.append(patch.grid.reshape(-1, 3))
        faces.append(np.column_stack([a, d, c]))
        faces.append(np.column_stack([a, c, b]))
        owner.append(np.full(rows * columns, index))
        place = np.stack(np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij"), axis=-1)
        unit.append(place.reshape(-1, 2))
        count += rows * columns
    return JoinedMesh(np.concatenate(vertices), np.concatenate(faces), np.concatenate(owner), np.concatenate(unit))
