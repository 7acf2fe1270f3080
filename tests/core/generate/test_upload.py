from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from r2c2r_core.errors import OverrideError
from r2c2r_core.generate.stage import GenerateConfig, generate_candidates
from r2c2r_core.generate.upload import read_upload
from r2c2r_core.geometry.meshes import is_manifold, is_watertight, join_vertices, oriented_extents, volume

MESHES = Path(__file__).resolve().parents[3] / "../shared/data/meshes"


def read(path):
    return read_upload(path, "thing_1", "upload0")


def assert_usable(asset):
    mesh = asset.mesh
    assert asset.watertight
    assert is_watertight(mesh.vertices, mesh.faces)
    assert is_manifold(mesh.vertices, mesh.faces)
    assert volume(*join_vertices(mesh.vertices, mesh.faces)) > 0
    assert np.ptp(mesh.vertices, axis=0).max() == pytest.approx(1.0)
    assert len(mesh.uv) == len(mesh.vertices)


def proportions(vertices):
    extents = oriented_extents(vertices)
    return extents / extents[0]


def textured_box(tmp_path, name="box.glb", flip=False):
    """A closed 300 x 200 x 100 box (millimetres, at any place) with half of its texture red."""
    mesh = trimesh.creation.box((300.0, 200.0, 100.0))
    mesh.apply_translation((1000.0, 5.0, -7.0))
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:, :32], picture[:, 32:] = (200, 10, 10), (10, 10, 200)
    uv = (mesh.vertices[:, :2] - mesh.vertices[:, :2].min(axis=0)) / [300.0, 200.0]
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(picture))
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    if flip:
        mesh.invert()
    mesh.export(tmp_path / name)
    return tmp_path / name


def test_a_watertight_textured_upload_keeps_its_texture_and_proportions(tmp_path):
    asset = read(textured_box(tmp_path))
    assert_usable(asset)
    assert asset.warnings == ()
    assert asset.candidate_id == "upload0"
    assert asset.generator == "upload"
    assert proportions(asset.mesh.vertices) == pytest.approx([1, 2 / 3, 1 / 3], rel=1e-4)
    assert asset.mesh.texture.shape == (64, 64, 3)


def test_an_inside_out_mesh_is_flipped_with_a_warning(tmp_path):
    asset = read(textured_box(tmp_path, flip=True))
    assert_usable(asset)
    assert any("inwards" in warning for warning in asset.warnings)


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "glb"])
def test_every_mesh_format_is_read(tmp_path, suffix):
    path = tmp_path / f"capsule.{suffix}"
    trimesh.creation.capsule(height=0.2, radius=0.05, count=[16, 16]).export(path)
    asset = read(path)
    assert_usable(asset)
    assert proportions(asset.mesh.vertices) == pytest.approx([1, 1 / 3, 1 / 3], rel=0.03)


def test_a_small_hole_is_filled_with_a_warning(tmp_path):
    mesh = trimesh.creation.box((1.0, 1.0, 2.0))
    mesh.update_faces(np.arange(len(mesh.faces)) != 3)
    mesh.export(tmp_path / "leak.stl")
    asset = read(tmp_path / "leak.stl")
    assert_usable(asset)
    assert any("holes were filled" in warning for warning in asset.warnings)
    assert proportions(asset.mesh.vertices) == pytest.approx([1, 0.5, 0.5], rel=1e-4)


def test_an_open_shell_is_remeshed_with_a_warning_and_keeps_its_colours(tmp_path):
    """Hole filling cannot close a bucket without wall thickness into a bucket, so it gets walls."""
    mesh = trimesh.creation.cylinder(radius=0.5, height=1.0, sections=48)
    sheet = mesh.submesh([np.flatnonzero(mesh.face_normals[:, 2] < 0.5)], append=True)
    handle = trimesh.creation.box((0.02, 1.0, 0.3))  # crosses the wall: edges with more than two faces after joining
    both = trimesh.util.concatenate([sheet, handle])
    both.visual.vertex_colors = np.tile([20, 160, 40, 255], (len(both.vertices), 1)).astype(np.uint8)
    both.export(tmp_path / "bucket.ply")
    asset = read(tmp_path / "bucket.ply")
    assert_usable(asset)
    assert asset.warnings
    assert np.median(asset.mesh.texture.reshape(-1, 3), axis=0) == pytest.approx([20, 160, 40], abs=3)
    assert proportions(asset.mesh.vertices) == pytest.approx([1, 1, 1], rel=0.06)


def test_large_meshes_are_simplified_with_a_warning(tmp_path):
    trimesh.creation.icosphere(subdivisions=5).export(tmp_path / "ball.stl")  # 20 480
    asset = read(tmp_path / "ball.stl")
    assert_usable(asset)
    assert len(asset.mesh.faces) <= 20_000
    assert any("simplified from 20480" in warning for warning in asset.warnings)


def test_the_frame_of_an_upload_is_reproducible_and_differs_by_object(tmp_path):
    path = textured_box(tmp_path)
    first, again = read(path), read(path)
    assert np.array_equal(first.mesh.vertices, again.mesh.vertices)
    other = read_upload(path, "thing_2", "upload0")
    assert not np.allclose(first.mesh.vertices, other.mesh.vertices, atol=0.05)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("model.fbx", b"x", "a mesh file expected"),
        ("broken.glb", b"glTF\x02\x00\x00\x00garbage", "not a readable GLB"),
        ("empty.obj", b"# nothing\n", "broken|no triangles|not a readable"),
        ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 3 4\nf 2 5 3\nf 1 2 4\n", "flat"),
        ("two.obj", b"v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nf 1 2 3\nf 1 3 4\n", "2 triangles"),
    ],
)
def test_unrepairable_files_are_rejected_with_a_one_line_message(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(OverrideError, match=message) as refusal:
        read(tmp_path / name)
    assert name in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_missing_upload_is_rejected(tmp_path):
    with pytest.raises(OverrideError, match="no such file"):
        read(tmp_path / "nowhere.glb")


def test_an_upload_joins_the_candidates(bottle_scene, tmp_path):
    path = textured_box(tmp_path)
    found = generate_candidates(*bottle_scene, "completion", GenerateConfig(count=1, pool_frames=8), uploads=(path,))
    assert [c.candidate_id for c in found.candidates] == ["c0", "upload0"]
    assert set(found.ranking) == {"c0", "upload0"}


@pytest.mark.skipif(not MESHES.exists(), reason="the shared meshes are not here")
@pytest.mark.parametrize("name", [pytest.param("sam3d-bench/0.glb", marks=pytest.mark.slow), "ycb-025_mug/textured.obj"])
def test_a_real_generated_mesh_and_a_real_scan_are_read(name):
    assert_usable(read(MESHES / name))


def test_vertices_with_two_coordinates_are_rejected(tmp_path):
    (tmp_path / "flat.obj").write_text("v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n")
    with pytest.raises(OverrideError, match=r"flat\.obj"):
        read(tmp_path / "flat.obj")
