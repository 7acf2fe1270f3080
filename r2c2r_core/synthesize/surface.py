"""Uniform surface samples of a mesh with normals, the basis of every measurement."""

from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.geometry.meshes import face_normals, sample_surface


class SurfaceSamples(NamedTuple):
    """Points distributed over a surface by area, with the unit normals of their faces."""

    points: Points
    normals: Points


def sampled(vertices: Points, faces: Faces, count: int, seed: int) -> SurfaceSamples:
    """`count` points of a surface; deterministic in the seed."""
    points, chosen = sample_surface(vertices, faces, count, np.random.default_rng(seed))
    return SurfaceSamples(points, face_normals(vertices, faces)[chosen])
