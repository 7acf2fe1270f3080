"""Mesh decimation for display, with the texture preserved."""

from typing import Any

import numpy as np

MAX_FACES = 100_000  # a larger scene takes software GL seconds per picture


def reduced(mesh: Any) -> Any:
    """A trimesh with at most about MAX_FACES faces; each kept vertex has the texture coordinate of the nearest old one."""
    import fast_simplification
    import trimesh
    from scipy.spatial import cKDTree

    vertices, faces = fast_simplification.simplify(
        np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32), target_count=MAX_FACES
    )
    nearest = cKDTree(mesh.vertices).query(vertices)[1]
    visual = trimesh.visual.TextureVisuals(uv=np.asarray(mesh.visual.uv)[nearest], material=mesh.visual.material)
    return trimesh.Trimesh(vertices, faces, visual=visual, process=False)
