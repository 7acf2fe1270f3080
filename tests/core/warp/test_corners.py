"""Front face of a mesh with a frame, a recessed panel, a handle and noise."""

import numpy as np
import pytest

from r2c2r_core.geometry.meshes import box_mesh, unite
from r2c2r_core.warp.corners import find_front

WIDTH, DEPTH, HEIGHT = 0.6, 0.56, 0.7
FRONT_Y = -DEPTH / 2


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    return box_mesh(np.array(low), np.array(high))


def shaker(sunk_m: float, frame_m: float = 0.06) -> tuple[np.ndarray, np.ndarray]:
    """A cabinet whose door has a panel `sunk_m` behind its frame, and a bar handle."""
    x, z = WIDTH / 2, HEIGHT / 2
    body = block((-x, FRONT_Y, -z), (x, DEPTH / 2, z))
    panel = block((-x + frame_m, FRONT_Y - 0.01, -z + frame_m), (x - frame_m, FRONT_Y + sunk_m, z - frame_m))
    handle = block((x - 0.05, FRONT_Y - 0.035, -0.1), (x - 0.03, FRONT_Y + 0.01, 0.1))
    return unite([unite([body], [panel]), handle])


def turned(vertices: np.ndarray, degrees: float) -> np.ndarray:
    """The vertices tilted about x and rotated about z, both by the angle."""
    a = np.deg2rad(degrees)
    lean = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    return np.asarray(vertices @ (turn @ lean).T)


@pytest.mark.parametrize("degrees", [0.0, 2.0])
@pytest.mark.parametrize("sunk_m", [0.005, 0.007, 0.012])
def test_the_front_of_a_shaker_door_is_its_frame(sunk_m: float, degrees: float) -> None:
    vertices, faces = shaker(sunk_m)
    vertices = turned(vertices, degrees)
    found = find_front(vertices, faces)
    assert found is not None
    x, z = WIDTH / 2, HEIGHT / 2
    corners = turned(np.array([[x, FRONT_Y, z], [-x, FRONT_Y, z], [-x, FRONT_Y, -z], [x, FRONT_Y, -z]]), degrees)
    np.testing.assert_allclose(found.corners, corners, atol=1.5e-3)  # accuracy of the samples' edge, where no vertex is nearer


def test_surface_noise_moves_the_front_by_less_than_1_mm() -> None:
    from trimesh.remesh import subdivide_to_size

    vertices, faces = shaker(0.012)
    vertices, faces = subdivide_to_size(vertices, faces, 0.02)
    noisy = vertices + np.random.default_rng(0).normal(0, 0.0005, vertices.shape)
    found = find_front(noisy, faces)
    assert found is not None
    assert abs(found.centre[1] - FRONT_Y) < 1e-3
    assert np.abs(np.ptp(found.corners, axis=0)[[0, 2]] - [WIDTH, HEIGHT]).max() < 6e-3


def test_a_mesh_without_forward_facing_surface_has_no_front() -> None:
    assert find_front(*box_mesh(np.zeros(3), np.array([1.0, 1e-4, 1.0]))) is not None
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert find_front(vertices, np.array([[0, 1, 2]])) is None


@pytest.mark.parametrize("seed", range(6))
def test_a_coplanar_strip_along_the_edge_belongs_to_the_front(seed: int) -> None:
    # As after a cut: a strip of the same plane, in separate faces; most of the surface is elsewhere
    x, y, top = 0.3, -4.0, 1.7
    body = block((-x, y, 0.0), (x, -y, top))
    strip = np.array([[-x, y, top], [x, y, top], [x, y, top + 0.0065], [-x, y, top + 0.0065]])
    vertices = np.concatenate([body[0], strip])
    faces = np.concatenate([body[1], len(body[0]) + np.array([[0, 1, 2], [0, 2, 3]])])
    found = find_front(vertices, faces, seed=seed)
    assert found is not None
    assert abs(found.corners[:, 2].max() - (top + 0.0065)) < 1e-3
