import manifold3d
import numpy as np
import pytest
from scipy.spatial import Delaunay
from trimesh import Trimesh
from trimesh.creation import annulus, cylinder, icosphere, revolve

from r2c2r_core.model.scene import ConvexPiece
from r2c2r_core.synthesize.things import convex_pieces


def pieces_of(mesh: Trimesh) -> tuple[ConvexPiece, ...]:
    return convex_pieces(np.asarray(mesh.vertices), np.asarray(mesh.faces), mesh.extents)


def test_a_convex_thing_is_one_piece_that_keeps_its_extents() -> None:
    mesh = cylinder(radius=0.04, height=0.3, sections=200)
    pieces = pieces_of(mesh)
    assert len(pieces) == 1
    np.testing.assert_allclose(np.ptp(pieces[0].vertices_link, axis=0), mesh.extents, atol=1e-3)
    assert np.abs(pieces[0].vertices_link).max(axis=0)[2] <= 0.15 + 1e-12


def test_a_dense_hull_is_simplified_without_leaving_the_shape() -> None:
    mesh = icosphere(subdivisions=4, radius=0.05)
    (piece,) = pieces_of(mesh)
    assert len(piece.vertices_link) <= 140
    assert (np.linalg.norm(piece.vertices_link, axis=1) <= 0.0501 + 0.006).all()


def test_colliders_of_a_tube_keep_its_bore_open() -> None:
    """A single convex hull of the tube would fill its bore; the pieces must not."""
    mesh = annulus(r_min=0.04, r_max=0.05, height=0.1, sections=24)
    pieces = pieces_of(mesh)
    assert 4 <= len(pieces) <= 16
    axis_points = np.array([[0.0, 0.0, z] for z in np.linspace(-0.04, 0.04, 9)])
    assert all((Delaunay(p.vertices_link).find_simplex(axis_points) < 0).all() for p in pieces)


def test_colliders_of_a_bottle_follow_its_neck() -> None:
    """One hull would be 12 mm off the neck, 30 mm wide, where a gripper holds it."""
    outline = np.array([[0, 0], [0.04, 0], [0.04, 0.15], [0.015, 0.18], [0.015, 0.24], [0, 0.24]]) - [0.0, 0.12]
    mesh = revolve(outline, sections=48)
    pieces = pieces_of(mesh)
    assert len(pieces) <= 3  # each pair of meshes costs GPU engines time
    heights = np.linspace(-0.115, 0.115, 24)
    radii = np.interp(heights, outline[1:5, 1], outline[1:5, 0])
    for factor, touched in ((0.9, True), (1.15, False)):
        points = np.column_stack([factor * radii, np.zeros(24), heights])
        inside = [Delaunay(p.vertices_link).find_simplex(points) >= 0 for p in pieces]
        assert (np.any(inside, axis=0) == touched).all()


def test_uneven_feet_are_flattened_into_one_underside() -> None:
    mesh = cylinder(radius=0.04, height=0.2, sections=40)
    vertices = np.asarray(mesh.vertices).copy()
    low = vertices[:, 2] < 0
    vertices[low, 2] += 0.004 * (vertices[low, 0] > 0)
    (piece,) = convex_pieces(vertices, np.asarray(mesh.faces), np.array([0.08, 0.08, 0.2]))
    assert (piece.vertices_link[:, 2] < -0.1 + 1e-9).sum() >= 10


def table_mesh(bump_m: float = 0.0) -> Trimesh:
    """A slab of 2 x 1 m on four legs, 0.7 m high, with a bump on its top."""
    parts = [(0.0, 0.0, 0.325, 2.0, 1.0, 0.05), *((x, y, -0.025, 0.08, 0.08, 0.65) for x in (-0.9, 0.9) for y in (-0.4, 0.4))]
    boxes = [manifold3d.Manifold.cube(part[3:], True).translate(part[:3]) for part in parts]
    if bump_m:
        boxes.append(manifold3d.Manifold.cube((0.3, 0.3, 0.02 + bump_m), True).translate((0.3, 0.1, 0.34 + bump_m / 2)))
    mesh = manifold3d.Manifold.batch_boolean(boxes, manifold3d.OpType.Add).to_mesh64()
    return Trimesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts), process=False)


def test_the_colliders_of_a_large_table_are_no_thicker_than_it_is() -> None:
    mesh = table_mesh()
    pieces = pieces_of(mesh)
    tops = [piece.vertices_link[:, 2].max() for piece in pieces]
    assert max(tops) == pytest.approx(0.35, abs=1e-3)
    assert sum(Trimesh(p.vertices_link).convex_hull.volume for p in pieces) < 1.3 * mesh.volume


def test_the_top_of_a_table_is_level_where_things_stand() -> None:
    mesh = table_mesh(bump_m=0.003)
    pieces = convex_pieces(np.asarray(mesh.vertices), np.asarray(mesh.faces), mesh.extents, flat_top=True)
    slab = max((piece.vertices_link for piece in pieces), key=lambda points: np.ptp(points[:, 0]))
    assert slab[:, 2].max() == pytest.approx(0.35, abs=1e-6)
