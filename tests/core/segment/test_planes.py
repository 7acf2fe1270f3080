"""Vertical planes of an exactly known surface."""

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import rotation_about_z
from r2c2r_core.model.capture import SceneSurface
from r2c2r_core.segment.planes import PlaneRegion, find_planes, region_along, region_at

CELL_M = 0.02  # of a region's support
CAMERAS = np.array([[0.0, -2.0, 1.4], [0.5, -1.8, 1.3]])


def patch(corner: tuple[float, ...], along: tuple[float, ...], up: tuple[float, ...], step_m: float = 0.02) -> SceneSurface:
    """A rectangle with edges `along` and `up`, facing along x up, in triangles of `step_m`."""
    start, a, b = (np.array(v, dtype=np.float64) for v in (corner, along, up))
    columns, rows = (max(1, round(float(np.linalg.norm(v)) / step_m)) for v in (a, b))
    s, t = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    vertices = start + s.reshape(-1, 1) * a + t.reshape(-1, 1) * b
    at = np.arange(len(vertices)).reshape(rows + 1, columns + 1)
    p, q, r, w = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    return surface(vertices, np.concatenate([np.stack([p, q, r], 1), np.stack([p, r, w], 1)]))


def surface(vertices: np.ndarray, faces: np.ndarray) -> SceneSurface:
    return SceneSurface(vertices_world=vertices, faces=faces, colours=np.zeros((len(vertices), 3), np.uint8), voxel_m=CELL_M)


def together(*parts: SceneSurface) -> SceneSurface:
    starts = np.cumsum([0] + [len(p.vertices_world) for p in parts])
    faces = np.concatenate([p.faces + n for p, n in zip(parts, starts, strict=False)])
    return surface(np.concatenate([p.vertices_world for p in parts]), faces)


def front(x: float = 0.0, y: float = 0.0, z: float = 0.3, width: float = 0.8, height: float = 0.6) -> SceneSurface:
    """A rectangle facing -Y with a given lower left corner."""
    return patch((x, y, z), (width, 0, 0), (0, 0, height))


def only(regions: tuple[PlaneRegion, ...]) -> PlaneRegion:
    assert len(regions) == 1
    return regions[0]


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.3, -2.0])
def test_a_rectangle_is_located_at_any_yaw_of_the_room(yaw: float) -> None:
    turn = rotation_about_z(yaw)
    shown = front()
    region = only(find_planes(surface(shown.vertices_world @ turn.T, shown.faces), CAMERAS @ turn.T))
    np.testing.assert_allclose(region.outward, turn @ [0, -1, 0], atol=1e-6)
    np.testing.assert_allclose(region.world_from_plane.translation, turn @ [0.4, 0.0, 0.6], atol=CELL_M)
    assert abs(float(region.world_from_plane.translation @ region.outward)) < 1e-6  # the plane itself is exact
    assert [region.width_m, region.height_m] == pytest.approx([0.8, 0.6], abs=2 * CELL_M)
    assert region.area_m2 == pytest.approx(0.48, rel=1e-6)


@pytest.mark.parametrize("yaw_deg", [0.5, 0.9, -0.6])
def test_a_long_run_between_two_yaw_bins_is_one_region(yaw_deg: float) -> None:
    turn = rotation_about_z(np.deg2rad(yaw_deg))
    shown = front(x=-4.0, width=8.0)
    region = only(find_planes(surface(shown.vertices_world @ turn.T, shown.faces), CAMERAS))
    assert region.width_m == pytest.approx(8.0, abs=2 * CELL_M)


def test_surface_noise_averages_out_in_the_fitted_plane() -> None:
    shown = front()
    noisy = shown.vertices_world + np.random.default_rng(3).normal(scale=[0, 0.003, 0], size=shown.vertices_world.shape)
    region = only(find_planes(surface(noisy, shown.faces), CAMERAS))
    assert np.degrees(np.arccos(region.outward @ [0, -1, 0])) < 0.2
    assert abs(region.world_from_plane.translation[1]) < 1e-3


def test_horizontal_and_back_facing_surfaces_are_ignored() -> None:
    level = patch((0, 0, 0.9), (0.8, 0, 0), (0, 0.6, 0))
    assert find_planes(level, CAMERAS) == ()
    assert find_planes(front(), CAMERAS * [1, -1, 1]) == ()


def test_fronts_with_8_cm_depth_offset_are_two_planes_larger_first() -> None:
    regions = find_planes(together(front(width=0.5), front(x=0.7, y=0.08, width=0.9)), CAMERAS)
    assert [round(float(r.world_from_plane.translation[1]), 3) for r in regions] == [0.08, 0.0]


def frame(stile: float, y: float = 0.0) -> SceneSurface:
    """Rails and stiles of that width around 0.6 by 0.5 m; the opening's lower left corner is at (0, 0.3)."""
    return together(
        front(-stile, y, 0.3 - stile, 0.6 + 2 * stile, stile),
        front(-stile, y, 0.8, 0.6 + 2 * stile, stile),
        front(-stile, y, 0.3, stile, 0.5),
        front(0.6, y, 0.3, stile, 0.5),
    )


def test_a_deeply_recessed_panel_belongs_to_the_plane_of_its_frame() -> None:
    region = only(find_planes(together(frame(0.06), front(0.0, 0.032, 0.3, 0.6, 0.5)), CAMERAS))
    assert abs(region.world_from_plane.translation[1]) < 0.004
    assert region.supports(np.array([[0.3, 0.032, 0.55]]), 0.0)[0]  # a click in the middle of the panel


def framed_run(sunk_m: float) -> SceneSurface:
    """Three bays of 0.6 by 0.5 m, 8 cm apart, with panels that far behind their frame."""
    bay = frame(0.04), front(0.0, sunk_m, 0.3, 0.6, 0.5)
    return together(*(surface(part.vertices_world + np.array([0.68 * k, 0, 0]), part.faces) for k in range(3) for part in bay))


def test_recessed_panels_join_their_frame_despite_a_plinth_at_their_depth() -> None:
    run = together(framed_run(0.031), front(-0.04, 0.031, 0.21, 2.0, 0.05))
    regions = find_planes(run, CAMERAS)
    for middle in (0.3, 0.98, 1.66):
        region = region_at(regions, np.array([middle, 0.031, 0.55]))
        assert region is not None
        assert abs(region.world_from_plane.translation[1]) < 0.004


def test_a_framed_run_takes_the_plane_of_its_frame_not_of_its_panels() -> None:
    run = framed_run(0.011)
    noise = np.random.default_rng(4).normal(scale=[0, 0.0015, 0], size=run.vertices_world.shape)
    region = find_planes(surface(run.vertices_world + noise, run.faces), CAMERAS)[0]
    assert abs(region.world_from_plane.translation[1]) < 0.001
    assert region.width_m == pytest.approx(2.04, abs=2 * CELL_M)


@pytest.mark.parametrize("before_m", [0.018, 0.03])
def test_a_protruding_refrigerator_does_not_rotate_the_plane_of_a_run(before_m: float) -> None:
    run, tall = front(width=1.9, height=0.7), front(x=1.9, y=-before_m, z=0.05, width=0.7, height=1.7)
    shown, turn = together(run, tall), rotation_about_z(np.deg2rad(0.45))  # between two bins of yaw
    noise = np.random.default_rng(5).normal(scale=[0, 0.002, 0], size=shown.vertices_world.shape)
    regions = find_planes(surface((shown.vertices_world + noise) @ turn.T, shown.faces), CAMERAS)
    ends = np.array([[0.0, 0.0, 0.6], [1.9, 0.0, 0.6]]) @ turn.T
    off = [np.abs(region.world_from_plane.inverse.apply(ends)[:, 1]).max() for region in regions]
    assert min(off) < 0.002


@pytest.mark.parametrize("parts", [(frame(0.06), 0.07), (frame(0.02), 0.032), (front(-0.6, 0.0, 0.3, 0.6, 0.5), 0.032)])
def test_deeper_panels_and_panels_without_stiles_are_separate_planes(parts: tuple[SceneSurface, float]) -> None:
    around, behind_m = parts
    regions = find_planes(together(around, front(0.0, behind_m, 0.3, 0.6, 0.5)), CAMERAS)
    assert any(abs(region.world_from_plane.translation[1] - behind_m) < 0.004 for region in regions)


def test_an_occlusion_sized_gap_is_bridged_and_a_wide_gap_is_not() -> None:
    def count(gap_m: float) -> int:
        return len(find_planes(together(front(width=0.5), front(x=0.5 + gap_m, width=0.5)), CAMERAS))

    assert count(0.07) == 1
    assert count(0.30) == 2


def test_only_points_near_the_observed_area_belong_to_a_region() -> None:
    region = only(find_planes(front(), CAMERAS))
    assert region.supports(region.points, 0.0).all()
    beside = np.array([[0.85, 0.0, 0.6], [1.1, 0.0, 0.6], [0.4, 0.0, 1.5]])
    assert region.supports(beside, 0.08).tolist() == [True, False, False]
    assert region_at((region,), np.array([0.4, 0.03, 0.6])) is region
    assert region_at((region,), np.array([0.4, 0.30, 0.6])) is None


def test_a_ray_hits_the_nearest_region_at_its_plane_intersection() -> None:
    near, far = front(width=0.5), front(x=-0.5, y=0.4, z=0.3, width=2.0)
    regions = find_planes(together(near, far), CAMERAS)
    for target in (np.array([0.25, 0.0, 0.6]), np.array([1.2, 0.4, 0.5])):
        ray = target - CAMERAS[0]
        found = region_along(regions, CAMERAS[0], ray / np.linalg.norm(ray), 5.0, 0.05)
        assert found is not None
        np.testing.assert_allclose(found[1], target, atol=1e-6)
    assert region_along(regions, CAMERAS[0], np.array([0.0, -1.0, 0.0]), 5.0, 0.05) is None
