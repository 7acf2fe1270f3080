"""Repair of defects in uploaded and generated meshes, and the notes about it."""

import json
import struct

import numpy as np
import pytest
import trimesh
from PIL import Image

from r2c2r_core.errors import OverrideError
from r2c2r_core.generate import repair
from r2c2r_core.generate.meshfile import missing_files, parts_of, read_parts
from r2c2r_core.generate.repair import mended
from r2c2r_core.generate.upload import read_upload
from r2c2r_core.geometry.meshes import is_manifold, is_watertight, join_vertices, oriented_extents, volume
from r2c2r_core.tuning import tuning
from tests.core.generate.stub import textured_box


@pytest.fixture(autouse=True)
def small_textures():
    """Small textures: one of 1024 px takes over a second, and most tests are about shape."""
    with tuning({repair.Params: repair.Params(texture_px=256)}):
        yield


def repaired(*geometries):
    """The repaired mesh, joined at its seams, in units of its longest side; and the notes."""
    mesh, notes = mended(parts_of(geometries), "mesh")
    vertices, faces = join_vertices(mesh.vertices, mesh.faces)
    vertices = vertices / np.ptp(vertices, axis=0).max()
    assert is_watertight(vertices, faces)
    assert is_manifold(vertices, faces)
    assert volume(vertices, faces) > 0
    return vertices, faces, " | ".join(notes)


def filled(vertices, faces):
    """Volume in units of the longest side cubed."""
    return volume(vertices, faces) / oriented_extents(vertices)[0] ** 3


def moved(mesh, *offset):
    mesh.apply_translation(offset)
    return mesh


def test_separate_bodies_are_united_and_kept():
    vertices, faces, notes = repaired(
        trimesh.creation.box((1.0, 0.5, 0.5)), moved(trimesh.creation.box((0.2, 0.5, 0.5)), 1.0, 0, 0)
    )
    assert "2 bodies were united" in notes
    assert filled(vertices, faces) * 1.6**3 == pytest.approx(0.25 + 0.05, rel=1e-3)


def test_inner_surfaces_are_removed():
    """TRELLIS leaves closed shells inside; volume and extents must be those of the outside (method.md row 16)."""
    shell = trimesh.creation.box((0.8, 0.6, 0.6))
    shell.invert()
    vertices, faces, notes = repaired(trimesh.util.concatenate([trimesh.creation.box((1.0, 0.8, 0.8)), shell]))
    assert "inner surfaces were removed" in notes
    assert filled(vertices, faces) == pytest.approx(0.64, rel=1e-3)


def test_overlapping_bodies_count_once():
    vertices, faces, _ = repaired(
        trimesh.creation.box((1.0, 0.5, 0.5)), moved(trimesh.creation.box((0.2, 0.2, 0.2)), 0, 0.25, 0)
    )
    assert filled(vertices, faces) == pytest.approx(0.25 + 0.2 * 0.2 * 0.1, rel=1e-3)


def test_two_boxes_that_share_an_edge_become_a_solid():
    _, _, notes = repaired(trimesh.creation.box((1, 1, 1)), moved(trimesh.creation.box((1, 1, 1)), 1, 1, 0))
    assert "2 bodies were united" in notes


def test_small_fragments_do_not_affect_the_extents():
    vertices, _, notes = repaired(
        trimesh.creation.box((1.0, 0.5, 0.5)), moved(trimesh.creation.icosphere(radius=0.003, subdivisions=1), 3, 0, 0)
    )
    assert "1 fragments" in notes
    extents = oriented_extents(vertices)
    assert extents / extents[0] == pytest.approx([1, 0.5, 0.5], rel=1e-3)


def test_unreferenced_vertices_do_not_affect_the_extents():
    box = textured_box((1.0, 0.5, 0.5))
    loose = trimesh.Trimesh(np.vstack([box.vertices, [[9.0, 0, 0]]]), box.faces, process=False)
    loose.visual = trimesh.visual.TextureVisuals(uv=np.vstack([box.visual.uv, [[0.5, 0.5]]]), material=box.visual.material)
    vertices, _, notes = repaired(loose)
    assert notes == ""
    assert np.ptp(vertices, axis=0).max() == pytest.approx(1.0)
    extents = oriented_extents(vertices)
    assert extents / extents[0] == pytest.approx([1, 0.5, 0.5], rel=1e-3)


def test_an_inverted_body_among_others_is_flipped():
    lid = moved(trimesh.creation.box((1, 1, 0.1)), 0, 0, 1)
    lid.invert()
    vertices, faces, _ = repaired(trimesh.creation.box((1, 1, 1)), lid)
    assert filled(vertices, faces) * 1.55**3 == pytest.approx(1.1, rel=1e-3)


def test_duplicate_and_degenerate_faces_are_removed():
    box = trimesh.creation.box((1.0, 0.6, 0.4))
    faces = np.vstack([box.faces, box.faces[:3], [[0, 0, 1]]])
    vertices, faces, notes = repaired(trimesh.Trimesh(box.vertices, faces, process=False))
    assert len(faces) == 12
    assert "3 duplicate faces" in notes
    extents = oriented_extents(vertices)
    assert extents / extents[0] == pytest.approx([1, 0.6, 0.4], rel=1e-3)


@pytest.mark.parametrize("size", [1e-44, 1e200])
def test_extreme_mesh_sizes_are_rejected(size):
    with pytest.raises(OverrideError, match="units long, 1e-09 to 1e\\+09 expected"):
        repaired(trimesh.Trimesh(np.eye(4, 3) * size, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], process=False))


def test_scattered_tiny_triangles_are_rejected():
    corners = np.eye(4, 3)[:, None] + 1e-3 * np.random.default_rng(0).random((4, 3, 3))
    with pytest.raises(OverrideError, match="the mesh cannot be repaired"):
        repaired(trimesh.Trimesh(corners.reshape(-1, 3), np.arange(12).reshape(4, 3), process=False))


def test_a_remeshed_body_keeps_its_proportions():
    """Part of a side is missing: the remeshed surface lies at the original one, not a voxel further out."""
    box = trimesh.creation.box((1.0, 0.3, 0.3)).subdivide().subdivide().subdivide()
    pinned = trimesh.creation.box((0.9, 0.2, 0.02))  # a shelf that pierces the side: edges with four faces after joining
    hole = (box.triangles_center[:, 0] > 0.3) & (box.face_normals[:, 2] > 0.9) & (box.triangles_center[:, 1] > 0)
    box.update_faces(~hole)
    vertices, _, notes = repaired(trimesh.util.concatenate([box, pinned]))
    extents = oriented_extents(vertices)
    assert extents / extents[0] == pytest.approx([1, 0.3, 0.3], abs=0.015), notes


def test_vertex_colours_are_kept_exactly_in_the_texture():
    red, blue = trimesh.creation.box((1, 0.5, 0.5)), moved(trimesh.creation.box((1, 0.5, 0.5)), 0.9, 0, 0)
    red.visual.vertex_colors, blue.visual.vertex_colors = [200, 20, 20, 255], [20, 20, 200, 255]
    mesh, _ = mended(parts_of([red, blue]), "mesh")
    seen = {tuple(colour) for colour in mesh.texture.reshape(-1, 3)}
    assert {(200, 20, 20), (20, 20, 200)} <= seen


def test_a_mesh_without_colours_is_reported():
    assert "no colours: shown grey" in repaired(trimesh.creation.box((1, 1, 1)))[2]
    painted = trimesh.creation.box((1, 1, 1))
    painted.visual.vertex_colors = [10, 200, 10, 255]
    assert "no colours" not in repaired(painted)[2]


def test_a_very_large_texture_is_downscaled_with_a_note():
    box = textured_box()
    box.visual.material.baseColorTexture = Image.fromarray(np.zeros((2100, 4200, 3), np.uint8))
    mesh, notes = mended(parts_of([box]), "mesh")
    assert mesh.texture.shape == (1024, 2048, 3)
    assert "reduced to 2048 x 1024" in notes[0]


def test_missing_material_and_texture_files_are_reported(tmp_path):
    obj = tmp_path / "chair.obj"
    corners = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    quads = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    obj.write_text(f"mtllib chair.mtl\n{corners}\nusemtl wood\n{quads}")
    assert missing_files(obj) == ("chair.mtl",)
    (tmp_path / "chair.mtl").write_text("newmtl wood\nmap_Kd -s 1 1 1 wood grain.png\n".replace("wood grain", "wood_grain"))
    assert missing_files(obj) == ("wood_grain.png",)
    asset = read_upload(obj, "chair_1", "upload0")
    assert any("wood_grain.png was not uploaded" in warning for warning in asset.warnings)
    assert asset.watertight


@pytest.mark.parametrize("named", ["../elsewhere/wood.mtl", "{folder}/elsewhere/wood.mtl", "link.mtl", "n" * 5000])
def test_material_files_outside_the_obj_folder_are_reported_and_not_read(tmp_path, named):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "wood.mtl").write_text("newmtl wood\nKd 1 0 0\nmap_Kd secret.png\n")
    (tmp_path / "upload").mkdir()
    (tmp_path / "upload" / "link.mtl").symlink_to(tmp_path / "elsewhere" / "wood.mtl")
    named = named.format(folder=tmp_path)
    obj = tmp_path / "upload" / "chair.obj"
    obj.write_text(f"mtllib {named}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wood\nf 1 2 3\n")
    assert missing_files(obj) == (named,)
    (part,) = read_parts(obj)
    assert part.is_plain


def test_an_external_texture_of_a_glb_is_reported_missing(tmp_path):
    document = json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": "skin%201.png"}, {"uri": "data:image/png;base64,"}]})
    chunk = document.encode() + b" " * (-len(document) % 4)
    path = tmp_path / "a.glb"
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(chunk), len(chunk), 0x4E4F534A) + chunk)
    assert missing_files(path) == ("skin 1.png",)
