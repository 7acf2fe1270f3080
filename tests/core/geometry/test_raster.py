from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics, depth_points
from r2c2r_core.geometry.fusion import DepthView, fuse_depth
from r2c2r_core.geometry.raster import rasterize, subdivide_long_edges
from r2c2r_core.geometry.transforms import Rigid3

FACES = np.array([[0, 1, 2], [0, 2, 3]])


def camera(cx: float = 96.0, cy: float = 64.0, fy: float = 150.0) -> Intrinsics:
    return Intrinsics(fx=150.0, fy=fy, cx=cx, cy=cy, width=192, height=128)


def wall(corners: list[tuple[float, float, float]]) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces, _ = subdivide_long_edges(np.array(corners, dtype=float), FACES, np.zeros((4, 3)), 0.2)
    return vertices, faces


@pytest.mark.parametrize(("cx", "cy", "fy"), [(96.0, 64.0, 150.0), (90.3, 70.8, 150.0), (101.49, 60.2, 171.0)])
def test_depth_of_a_slanted_plane_is_exact_at_pixel_centres(cx: float, cy: float, fy: float) -> None:
    vertices, faces = wall([(-2, -2, 1.5), (2, -2, 2.5), (2, 2, 3.5), (-2, 2, 2.5)])
    view = camera(cx, cy, fy)
    raster = rasterize(vertices, faces, np.zeros((len(vertices), 3)), view, Rigid3())
    points = depth_points(raster.depth_m.astype(np.float64), view)[raster.depth_m > 0]
    assert len(points) > 10_000
    # the plane z = 2.5 + 0.25 x + 0.25 y
    assert np.abs(points[:, 2] - 2.5 - 0.25 * points[:, 0] - 0.25 * points[:, 1]).max() < 2e-4  # m: float32 rasteriser


def test_attributes_are_interpolated_in_perspective() -> None:
    vertices, faces = wall([(-1, -1, 1.0), (1, -1, 3.0), (1, 1, 3.0), (-1, 1, 1.0)])
    raster = rasterize(vertices, faces, vertices, camera(), Rigid3())
    seen = raster.depth_m > 0
    points = depth_points(raster.depth_m.astype(np.float64), camera())
    assert np.abs(raster.attributes[seen] - points[seen]).max() < 2e-3


def test_triangles_crossing_behind_the_camera_are_clipped() -> None:
    vertices, faces = wall([(-1, 1, -2.0), (1, 1, -2.0), (1, 1, 3.0), (-1, 1, 3.0)])  # a floor that passes under the camera
    raster = rasterize(vertices, faces, np.zeros((len(vertices), 3)), camera(), Rigid3())
    assert (raster.depth_m[:64] == 0).all()  # nothing above the horizon


def test_a_fused_plane_matches_the_depth_and_is_reproducible() -> None:
    vertices, faces = wall([(-2, -2, 1.5), (2, -2, 2.5), (2, 2, 3.5), (-2, 2, 2.5)])
    views = []
    for shift in (-0.1, 0.0, 0.1):
        pose = Rigid3(np.eye(3), np.array([shift, 0.0, 0.0]))
        depth = rasterize(vertices, faces, np.zeros((len(vertices), 3)), camera(90.3, 70.8), pose.inverse).depth_m
        views.append(DepthView(depth, camera(90.3, 70.8), pose))
    first, second = (fuse_depth(iter(views), 0.02) for _ in range(2))
    distance = (first.vertices[:, 2] - 2.5 - 0.25 * first.vertices[:, 0] - 0.25 * first.vertices[:, 1]) / np.sqrt(1.125)
    assert abs(np.median(distance)) < 1e-3  # half a pixel of shift would be 3 mm
    assert np.array_equal(first.faces, second.faces)
    assert np.array_equal(first.vertices, second.vertices)


def test_a_mesh_in_a_corner_is_drawn_as_in_a_larger_image_and_one_beside_the_image_not_at_all() -> None:
    vertices, faces = wall([(0.913, 0.517, 2.0), (1.6, 0.517, 2.2), (1.6, 1.3, 2.2), (0.913, 1.3, 2.0)])
    small = rasterize(vertices, faces, vertices, camera(), Rigid3())
    large = rasterize(vertices, faces, vertices, replace(camera(), width=400, height=300), Rigid3())
    assert 0 < (small.depth_m > 0).sum() < (large.depth_m > 0).sum()
    assert np.abs(small.depth_m - large.depth_m[:128, :192]).max() < 2e-4  # m: float32 rasteriser
    assert np.abs(small.attributes - large.attributes[:128, :192]).max() < 2e-3
    for moved in (vertices - [9.0, 0.0, 0.0], vertices - [0.0, 0.0, 9.0]):  # to the left, and behind the camera
        assert not rasterize(moved, faces, moved, camera(), Rigid3()).depth_m.any()
