"""Normalisation of shapes into assets: unit size, pose where it is known, and scale-free shape metrics."""

import numpy as np

from r2c2r_core.arrays import Faces, Image, Points, TextureCoords
from r2c2r_core.geometry.meshes import oriented_extents, volume
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.model.mesh import TexturedMesh


def centred(
    vertices: Points, source: np.ndarray, faces: Faces, uv: TextureCoords, texture: Image
) -> tuple[TexturedMesh, Similarity3]:
    """The mesh centred with its longest side 1, and the similarity from that frame back to the frame of `vertices`.

    `source` gives the original vertex of each skin vertex; vertices are moved before they are copied, so seams stay exactly
    closed.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle, longest = (low + high) / 2, float((high - low).max())
    unit = (vertices - middle) / longest
    return TexturedMesh(vertices=unit[source], faces=faces, uv=uv, texture=texture), Similarity3(longest, np.eye(3), middle)


def unposed(mesh: TexturedMesh, rng: np.random.Generator) -> TexturedMesh:
    """The mesh in an arbitrary frame: randomly rotated about any axis, centred, its longest side 1 (as TRELLIS returns)."""
    places, source = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return centred(places @ random_rotation(rng).T, source.reshape(-1), mesh.faces, mesh.uv, mesh.texture)[0]


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A uniformly distributed random rotation (a random unit quaternion)."""
    quat_wxyz = rng.normal(size=4)
    w, x, y, z = quat_wxyz / np.linalg.norm(quat_wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def shape_metrics(vertices: Points, faces: Faces) -> dict[str, float]:
    """Scale-free shape metrics: sides of the smallest box over its longest side, and the filled fraction of that box."""
    extents = oriented_extents(vertices)
    longest = max(float(extents[0]), 1e-12)
    return {
        "extent_middle": float(extents[1]) / longest,
        "extent_short": float(extents[2]) / longest,
        "volume_ratio": volume(vertices, faces) / max(float(np.prod(extents)), 1e-18),
        "faces": float(len(faces)),
    }
