"""A mug with a handle, made of solids: its colliders keep its cavity open and stay inside its walls."""

import manifold3d
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from r2c2r_core.geometry.hollows import find_hollow
from r2c2r_core.synthesize.things import convex_pieces
from r2c2r_core.synthesize.vessels import staves

RADIUS_M, WALL_M, FLOOR_M = 0.04, 0.004, 0.006


def mug(height_m: float = 0.09, radius_m: float = RADIUS_M) -> tuple[np.ndarray, np.ndarray]:
    outer = manifold3d.Manifold.cylinder(height_m, radius_m, radius_m, 48)
    inner = manifold3d.Manifold.cylinder(height_m, radius_m - WALL_M, radius_m - WALL_M, 48).translate((0, 0, FLOOR_M))
    ring = manifold3d.Manifold.revolve(manifold3d.CrossSection.circle(0.006, 12).translate((0.025, 0)), 24)
    handle = ring.rotate((90, 0, 0)).translate((radius_m + 0.012, 0, height_m / 2))
    core = manifold3d.Manifold.cylinder(height_m, radius_m - WALL_M / 2, radius_m - WALL_M / 2, 48)
    mesh = ((outer - inner) + (handle - core)).translate((0, 0, -height_m / 2)).to_mesh64()
    return np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, dtype=np.int64)


def share_filled(points: np.ndarray, pieces: list[np.ndarray]) -> float:
    filled = np.zeros(len(points), dtype=bool)
    for corners in pieces:
        planes = ConvexHull(corners).equations
        filled |= (points @ planes[:, :3].T + planes[:, 3] < 0).all(axis=1)
    return float(filled.mean())


@pytest.mark.parametrize(("height_m", "radius_m"), [(0.09, 0.04), (0.06, 0.09)])
def test_colliders_of_a_mug_and_a_bowl_keep_the_cavity_open(height_m: float, radius_m: float) -> None:
    vertices, faces = mug(height_m, radius_m)
    hollow = find_hollow(vertices, faces)
    assert hollow is not None
    assert hollow.floor_z == pytest.approx(FLOOR_M - height_m / 2, abs=1e-5)
    pieces = convex_pieces(vertices, faces, np.ptp(vertices, axis=0))
    assert share_filled(hollow.points, [piece.vertices_link for piece in pieces]) < 0.05


def test_a_straight_wall_has_one_collider_for_each_stave() -> None:
    pieces = staves(*mug())
    assert pieces is not None
    assert len(pieces) <= 24  # 16 staves, the floor, and the handle in parts


def test_the_hole_of_a_mug_handle_stays_open() -> None:
    vertices, faces = mug()
    pieces = staves(vertices, faces)
    assert pieces is not None
    finger = np.array([[RADIUS_M + 0.008, y, 0.0] for y in (-0.01, 0.0, 0.01)])
    assert share_filled(finger, pieces) == 0.0


def test_solids_without_an_upward_hollow_are_not_vessels() -> None:
    block = manifold3d.Manifold.cube((0.1, 0.1, 0.1)).to_mesh64()
    assert staves(np.array(block.vert_properties), np.array(block.tri_verts, dtype=np.int64)) is None
    vertices, faces = mug()
    assert staves(vertices * [1, -1, -1], faces) is None  # upside down
