"""Clean-up of the fused surface."""

import numpy as np

from r2c2r_core.geometry.fusion import Surface
from r2c2r_core.ingest.cloud import drop_crumbs, drop_outliers


def patch() -> tuple[np.ndarray, np.ndarray]:
    """A flat square of 1 m: 21 x 21 vertices and half of its triangles."""
    x, y = np.meshgrid(np.linspace(0, 1, 21), np.linspace(0, 1, 21))
    corner = np.arange(21 * 20).reshape(20, 21)[:, :20].ravel()
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), np.column_stack([corner, corner + 1, corner + 21])


def spiked() -> tuple[Surface, int]:
    """The patch with a spike of two far vertices on it, and the number of the patch's faces."""
    flat, faces = patch()
    vertices = np.concatenate([flat, [[0.0, 0.0, 0.6], [0.0, 0.1, 0.9]]])
    return Surface(vertices, np.concatenate([faces, [[0, len(flat), len(flat) + 1]]]), np.zeros_like(vertices)), len(faces)


def test_statistical_outliers_attached_to_a_surface_are_removed():
    surface, flat_faces = spiked()
    cleaned = drop_outliers(surface, 20)
    assert cleaned.vertices[:, 2].max() == 0.0
    assert len(cleaned.faces) >= 0.97 * flat_faces
    assert drop_crumbs(surface, 0.01).vertices[:, 2].max() == 0.9  # connected, so not a crumb


def test_a_small_disconnected_fragment_is_removed():
    flat, faces = patch()
    vertices = np.concatenate([flat, [[0, 0, 1.0], [0.02, 0, 1.0], [0, 0.02, 1.0]]])
    floating = np.concatenate([faces, [[len(flat), len(flat) + 1, len(flat) + 2]]])
    assert drop_crumbs(Surface(vertices, floating, np.zeros_like(vertices)), 0.004).vertices[:, 2].max() == 0.0
