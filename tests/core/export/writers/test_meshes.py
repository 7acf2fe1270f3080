from pathlib import Path

import numpy as np
import pytest
import trimesh

from r2c2r_core.errors import ExportFailed
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.writers.meshes import box_mesh, convex_hull, write_meshes
from tests.core.export.kitchen import kitchen


def test_a_textured_obj_comes_back_with_its_corners_uv_and_picture(tmp_path: Path) -> None:
    plan = plan_bundle(kitchen())
    write_meshes(plan, tmp_path, 2048)
    body = next(b for b in plan.bodies if b.name == "cabinet_1_door")
    loaded = trimesh.load(tmp_path / body.visual_file, force="mesh", process=False)
    np.testing.assert_allclose(loaded.vertices, body.link.visual.vertices, atol=1e-6)
    np.testing.assert_allclose(loaded.visual.uv, body.link.visual.uv, atol=1e-6)
    np.testing.assert_array_equal(np.asarray(loaded.visual.material.image.convert("RGB")), body.link.visual.texture)


def test_textures_are_bounded(tmp_path: Path) -> None:
    import cv2

    plan = plan_bundle(kitchen())
    write_meshes(plan, tmp_path, 32)
    sizes = {cv2.imread(str(tmp_path / b.texture_file)).shape[:2] for b in plan.bodies if b.texture_file}
    assert sizes == {(32, 32)}


def test_a_hull_is_closed_and_faces_outwards() -> None:
    vertices, faces = convex_hull(np.random.default_rng(0).normal(size=(60, 3)), "ball")
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0


def test_a_flat_piece_is_refused_by_name() -> None:
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    with pytest.raises(ExportFailed, match="cup: collider wall is flat"):
        convex_hull(flat, "cup: collider wall")


def test_boxes_face_outwards() -> None:
    body = plan_bundle(kitchen()).bodies[0]
    vertices, faces = box_mesh(body)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.volume == pytest.approx(sum(np.prod(box.size_m) for box in body.link.boxes))
