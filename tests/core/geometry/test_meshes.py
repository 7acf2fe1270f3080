import numpy as np
import pytest

from r2c2r_core.geometry import meshes

LOW, HIGH = np.array([-0.5, -1.0, -1.5]), np.array([0.5, 1.0, 1.5])


def bumpy_sphere(rings=60, noise=0.01):
    """A closed, noisy sphere of radius 1 from marching cubes."""
    from skimage.measure import marching_cubes

    axis = np.linspace(-1.3, 1.3, rings)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    field = np.sqrt(x**2 + y**2 + z**2) - 1 + noise * np.random.default_rng(0).normal(size=x.shape)
    vertices, faces, _, _ = marching_cubes(field, 0.0, spacing=(axis[1] - axis[0],) * 3)
    vertices, faces = meshes.largest_component(vertices.astype(float), faces.astype(np.int64))
    return (vertices, faces) if meshes.volume(vertices, faces) > 0 else (vertices, faces[:, ::-1])


def test_a_box_mesh_is_closed_manifold_and_outward_with_its_volume():
    vertices, faces = meshes.box_mesh(LOW, HIGH)
    assert meshes.is_watertight(vertices, faces)
    assert meshes.is_manifold(vertices, faces)
    assert meshes.volume(vertices, faces) == pytest.approx(6.0)
    outward = (meshes.face_normals(vertices, faces) * vertices[faces].mean(axis=1)).sum(axis=1)
    assert (outward > 0).all()


def test_reversed_faces_give_a_negative_volume():
    vertices, faces = meshes.box_mesh(LOW, HIGH)
    assert meshes.volume(vertices, faces[:, ::-1]) == pytest.approx(-6.0)


def test_missing_flipped_and_duplicate_faces_are_not_watertight():
    vertices, faces = meshes.box_mesh(LOW, HIGH)
    flipped = faces.copy()
    flipped[3] = flipped[3, ::-1]
    assert not meshes.is_watertight(vertices, faces[1:])
    assert not meshes.is_watertight(vertices, flipped)
    assert not meshes.is_watertight(vertices, np.concatenate([faces, faces[:1]]))


def test_duplicate_vertices_along_seams_do_not_count_as_holes():
    vertices, faces = meshes.box_mesh(LOW, HIGH)
    assert meshes.is_watertight(vertices[faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))


def test_union_and_difference_have_the_expected_volumes():
    slab = meshes.box_mesh(np.array([0.0, 0.0, 0.0]), np.array([1.0, 1.0, 1.0]))
    beside = meshes.box_mesh(np.array([0.5, 0.25, 0.25]), np.array([1.5, 0.75, 0.75]))
    assert meshes.volume(*meshes.unite([slab, beside])) == pytest.approx(1.125)
    hollowed = meshes.unite([slab], [beside])
    assert meshes.volume(*hollowed) == pytest.approx(0.875)
    assert meshes.is_watertight(*hollowed)


def test_simplification_keeps_meshes_closed_and_within_the_face_limit():
    vertices, faces = bumpy_sphere()
    simple = meshes.simplify(vertices, faces, 0.005, 3000)
    assert len(faces) > 10_000
    assert len(simple[1]) <= 3000
    assert meshes.is_watertight(*simple)
    assert meshes.is_manifold(*simple)
    assert meshes.volume(*simple) == pytest.approx(4 / 3 * np.pi, rel=0.03)


def test_simplifying_an_open_mesh_raises():
    vertices, faces = meshes.box_mesh(LOW, HIGH)
    with pytest.raises(ValueError, match="not a closed manifold"):
        meshes.simplify(vertices, faces[1:], 0.01, 100)


def test_the_largest_component_is_kept():
    big, small = meshes.box_mesh(LOW, HIGH), meshes.box_mesh(np.array([3.0, 3.0, 3.0]), np.array([3.1, 3.1, 3.1]))
    both = np.concatenate([small[0], big[0]]), np.concatenate([small[1], big[1] + 8])
    vertices, faces = meshes.largest_component(*both)
    assert len(vertices) == 8
    assert meshes.volume(vertices, faces) == pytest.approx(6.0)


def test_surface_samples_lie_on_the_mesh_and_follow_face_areas():
    vertices, faces = meshes.box_mesh(LOW, HIGH)
    points, face = meshes.sample_surface(vertices, faces, 4000, np.random.default_rng(0))
    assert meshes.distances_to_mesh(points, vertices, faces).max() < 1e-6
    share = np.bincount(face, minlength=12) / 4000
    assert np.abs(share - meshes.face_areas(vertices, faces) / 22.0).max() < 0.03


def test_oriented_extents_do_not_depend_on_the_rotation():
    vertices, _ = meshes.box_mesh(LOW, HIGH)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    assert meshes.oriented_extents(vertices @ turn.T) == pytest.approx([3.0, 2.0, 1.0], rel=1e-6)
