import numpy as np
import pytest

from r2c2r_core.generate.lathe import lathe_mesh
from r2c2r_core.generate.symmetry import Revolution, fit_revolution, is_rounder_than_box
from r2c2r_core.geometry.meshes import is_manifold, is_watertight, volume


def half_seen(shape, rng):
    """Noisy points on the half of an upright body that faces -Y."""
    angle, z = rng.uniform(np.pi * 1.05, np.pi * 1.95, 2000), rng.uniform(0.0, 0.3, 2000)
    x, y = np.cos(angle), np.sin(angle)
    if shape == "box":
        side = np.maximum(np.abs(x), np.abs(y))
        x, y = x / side, y / side
    return np.column_stack([0.05 * x + 0.2, 0.05 * y - 0.1, z]) + rng.normal(0, 0.002, (2000, 3))


def test_a_lathe_mesh_is_closed_and_has_the_volume_of_its_profile():
    vertices, faces = lathe_mesh(Revolution(np.array([0.3, -0.2]), np.array([0.0, 1.0]), np.array([0.5, 0.25])))
    assert is_watertight(vertices, faces)
    assert is_manifold(vertices, faces)
    cone = np.pi / 3 * (0.25 + 0.125 + 0.0625)
    assert volume(vertices, faces) == pytest.approx(cone, rel=0.01)  # 40 segments inscribe the circle


def test_axis_and_radii_are_fitted_from_the_observed_half():
    found = fit_revolution(half_seen("round", np.random.default_rng(0)))
    assert found is not None
    assert found.centre == pytest.approx([0.2, -0.1], abs=0.003)
    assert found.radii_m == pytest.approx(np.full(8, 0.05), abs=0.002)


def test_only_round_points_are_classified_as_round():
    rng = np.random.default_rng(0)
    for shape in ("round", "box"):
        points = half_seen(shape, rng)
        found = fit_revolution(points)
        assert found is not None
        assert is_rounder_than_box(points, found) == (shape == "round")
