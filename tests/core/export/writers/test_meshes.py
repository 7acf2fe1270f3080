from pathlib import Path

import numpy as np
import pytest
import trimesh

from r2c2r_core.errors import ExportFailed
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.writers.meshes import MOST_HULL_VERTICES, boxes_mesh, convex_hull
from tests.core.export.conftest import write_meshes
from tests.core.export.kitchen import kitchen


def test_a_textured_obj_round_trips_vertices_uv_and_texture(tmp_path: Path) -> None:
    plan = plan_bundle(kitchen())
    write_meshes(plan, tmp_path)
    body = next(b for b in plan.bodies if b.name == "cabinet_1_door")
    loaded = trimesh.load(tmp_path / body.visual_file, force="mesh", process=False)
    np.testing.assert_allclose(loaded.vertices, body.link.visual.vertices, atol=1e-6)
    np.testing.assert_allclose(loaded.visual.uv, body.link.visual.uv, atol=1e-6)
    np.testing.assert_array_equal(np.asarray(loaded.visual.material.image.convert("RGB")), body.link.visual.texture)


def test_textures_are_limited_in_size(tmp_path: Path) -> None:
    import cv2

    plan = plan_bundle(kitchen())
    write_meshes(plan, tmp_path, 32)
    sizes = {cv2.imread(str(tmp_path / b.texture_file)).shape[:2] for b in plan.bodies if b.texture_file}
    assert sizes == {(32, 32)}


def test_a_convex_hull_is_watertight_and_faces_outwards() -> None:
    vertices, faces = convex_hull(np.random.default_rng(0).normal(size=(60, 3)), "ball")
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0


def test_a_hull_is_reduced_to_64_vertices_with_little_volume_loss() -> None:
    ball = np.random.default_rng(0).normal(size=(150, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    whole = trimesh.convex.convex_hull(ball).volume
    vertices, faces = convex_hull(ball, "ball")
    assert len(vertices) == MOST_HULL_VERTICES
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert 0.9 * whole < mesh.volume < whole


def test_a_hull_has_at_most_20_coplanar_vertices() -> None:
    angles = np.linspace(0, 2 * np.pi, 30, endpoint=False)
    rings = [np.column_stack([np.cos(angles), np.sin(angles), np.full(30, z)]) for z in (0.0, 1.0)]
    vertices, faces = convex_hull(np.concatenate(rings), "tin")
    assert [int((vertices[:, 2] == z).sum()) for z in (0.0, 1.0)] == [20, 20]
    assert trimesh.Trimesh(vertices, faces, process=False).volume > 0.95 * np.pi


def test_a_flat_collider_is_rejected_by_name() -> None:
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    with pytest.raises(ExportFailed, match="cup: collider wall is flat"):
        convex_hull(flat, "cup: collider wall")


def test_boxes_meshes_face_outwards() -> None:
    body = plan_bundle(kitchen()).bodies[0]
    vertices, faces = boxes_mesh(body)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.volume == pytest.approx(sum(np.prod(box.size_m) for box in body.link.boxes))
