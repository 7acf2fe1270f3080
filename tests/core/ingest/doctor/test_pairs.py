"""Agreement between views, on a corner with exact depth and poses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.ingest.doctor.pairs import angle_deg, compare, far_pairs, neighbours, overlaps, spread
from tests.core.ingest.doctor.corner import views_of


def test_view_agreement_decreases_with_larger_pose_errors() -> None:
    views = views_of()
    pairs = neighbours(views)
    exact = compare(views, pairs)
    assert exact.agreement.mean() > 0.6  # the rest is outside the neighbour's picture, or behind the box
    assert exact.error_m.max() < 0.01  # a pixel of 160 covers 1 cm at 2 m, more at grazing angles
    assert (exact.cost < 0.5).all()
    costs = [exact.cost.mean()]
    for off_m in (0.03, 0.1):
        jitter = np.random.default_rng(1).normal(0, off_m, views.translation.shape)
        costs.append(compare(views.posed(views.rotation, views.translation + jitter), pairs).cost.mean())
    assert costs[0] < costs[1] < costs[2]


def test_a_point_projects_to_the_pixel_that_observes_it() -> None:
    views = views_of(2)
    views = views.posed(np.stack([views.rotation[0]] * 2), np.stack([views.translation[0]] * 2))
    views = replace(views, depth_m=np.stack([views.depth_m[0]] * 2))
    found = compare(views, np.array([[0, 1]]))
    np.testing.assert_array_equal(found.column[0], np.floor(views.point_uv[0, :, 0]))
    np.testing.assert_array_equal(found.row[0], np.floor(views.point_uv[0, :, 1]))
    np.testing.assert_allclose(found.apart_m[0], 0.0, atol=1e-9)
    assert found.seen.all()


def test_ray_length_depth_agrees_when_interpreted_along_the_ray() -> None:
    views = views_of()
    rows, columns = views.depth_m.shape[1:]
    u, v = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
    (fx, fy), (cx, cy) = views.focal[0], views.centre[0]
    longer = np.sqrt(1 + ((u - cx) / fx) ** 2 + ((v - cy) / fy) ** 2)
    of_points = np.sqrt(1 + (((views.point_uv - views.centre[:, None]) / views.focal[:, None]) ** 2).sum(axis=2))
    along = replace(views, depth_m=views.depth_m * longer, point_z=views.point_z * of_points)
    pairs = neighbours(views)
    wrong, right = compare(along, pairs), compare(along, pairs, along_ray=True)
    assert right.cost.mean() < 0.5 * wrong.cost.mean()
    assert right.cost.mean() == pytest.approx(compare(views, pairs).cost.mean(), rel=0.05)


def test_points_without_depth_are_not_evaluated() -> None:
    views = views_of()
    blind = replace(views, point_z=np.zeros_like(views.point_z))
    found = compare(blind, neighbours(views))
    assert not found.known.any()
    assert not found.seen.any()
    assert np.isnan(found.error_m).all()
    assert (found.agreement == 0).all()


def test_neighbours_are_later_views_with_sufficient_motion() -> None:
    views = views_of(40)
    pairs = neighbours(views)
    assert (pairs[:, 1] > pairs[:, 0]).all()
    assert len(pairs) == 39
    for a, b in pairs.tolist():
        moved = np.linalg.norm(views.translation[b] - views.translation[a]) > 0.15
        turned = angle_deg(views.rotation[a], views.rotation[b]) > 8
        assert moved or turned or b in (a + 6, 39)  # or the last of the six after it


def test_pairs_for_the_scale_check_have_parallax_and_overlap() -> None:
    views = views_of(20)
    pairs = far_pairs(views, 8)
    assert 0 < len(pairs) <= 8
    every, overlap = overlaps(views)
    shares = {tuple(pair): share for pair, share in zip(every.tolist(), overlap, strict=True)}
    for a, b in pairs.tolist():
        apart = np.linalg.norm(views.translation[a] - views.translation[b])
        assert apart / max(np.median(views.point_z[a]), 0.3) > 0.1
        assert shares[(a, b)] > 0.2


def test_selected_pairs_are_spread_evenly_over_the_views() -> None:
    every = np.array([[0, k] for k in range(1, 9)] + [[k, k + 1] for k in range(1, 8)])
    wanted = np.concatenate([np.full(8, 2.0), np.linspace(1.0, 0.5, 7)])
    chosen = spread(every, wanted, 6)
    assert len(chosen) == 6
    assert np.bincount(chosen.ravel()).max() <= 2  # three pairs times six over nine views
    assert len(spread(every, np.zeros(15), 6)) == 0


@pytest.mark.parametrize("deg", [0.0, 3.0, 90.0, 180.0])
def test_the_angle_between_rotations_is_their_relative_rotation_angle(deg: float) -> None:
    base = Rotation.random(random_state=4)
    turn = Rotation.from_rotvec(np.radians(deg) * np.array([0.0, 0.6, 0.8]))
    assert angle_deg(base.as_matrix(), (base * turn).as_matrix()) == pytest.approx(deg, abs=1e-5)
