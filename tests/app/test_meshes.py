from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.drawing import mesh_picture
from app.services.meshes import mesh_glb, turned_like
from r2c2r_core.model.mesh import TexturedMesh
from tests.app.nouns import BOX, FACES

SIZES = np.array([0.9, 0.5, 0.6])


def cupboard() -> TexturedMesh:
    """A box whose front (-Y) is red, top blue, the rest grey; no vertices are shared between faces."""
    triangles = BOX[FACES] * SIZES
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    texture = np.full((3, 3, 3), 128, np.uint8)
    texture[:, 0], texture[:, 2] = (250, 0, 0), (0, 0, 250)
    column = np.where(normals[:, 1] < -1e-9, 0.1, np.where(normals[:, 2] > 1e-9, 0.9, 0.5))
    uv = np.repeat(np.column_stack([column, np.full(len(column), 0.5)]), 3, axis=0)
    return TexturedMesh(vertices=triangles.reshape(-1, 3), faces=np.arange(36).reshape(-1, 3), uv=uv, texture=texture)


@pytest.mark.parametrize("seed", range(4))
def test_a_candidate_is_rotated_to_match_the_placed_mesh(seed: int) -> None:
    model = cupboard()
    rng = np.random.default_rng(seed)
    unknown = Rotation.random(rng=rng).as_matrix()
    turned = replace(model, vertices=2.5 * model.vertices @ unknown.T + rng.normal(size=3))
    found = turned_like(turned, model) @ unknown
    angle = np.degrees(Rotation.from_matrix(found).magnitude())
    assert angle < 1.0  # degrees: the box is exact, the error is from sampling


def test_the_mesh_picture_shows_mostly_the_front() -> None:
    import cv2

    image = cv2.imdecode(np.frombuffer(mesh_picture(cupboard(), np.eye(3)), np.uint8), cv2.IMREAD_UNCHANGED)
    assert image.shape == (320, 320, 4)
    shown = image[image[..., 3] > 0]
    red = (shown[:, 2] > 100) & (shown[:, 0] < 60)
    blue = (shown[:, 0] > 100) & (shown[:, 2] < 60)
    assert red.mean() > 0.35
    assert 0.05 < blue.mean() < red.mean()


def test_the_glb_has_y_up_as_gltf_requires() -> None:
    import io

    import trimesh

    loaded = trimesh.load(io.BytesIO(mesh_glb(cupboard(), np.eye(3))), file_type="glb", force="mesh")
    width, height, depth = loaded.extents  # glTF: +Y up
    assert np.argsort([width, height, depth]).tolist() == np.argsort([SIZES[0], SIZES[2], SIZES[1]]).tolist()
