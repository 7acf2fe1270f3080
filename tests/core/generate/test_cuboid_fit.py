"""Box fit to outlines and depth, from any initial guess and in any frame."""

import numpy as np
import pytest

from r2c2r_core.generate.cuboid import Cuboid, fit_cuboid, room_behind, surface_distance
from r2c2r_core.generate.evidence import Evidence, gather_evidence, masked_points
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.model.capture import Wall
from tests.core.generate.scenes import carton_scene

SIZE = np.array([0.19, 0.12, 0.29])
MIDDLE = np.array([0.0, SIZE[1] / 2, 0.9 + SIZE[2] / 2])


@pytest.fixture(scope="module")
def carton() -> Evidence:
    return gather_evidence(*carton_scene(SIZE, arc_deg=100.0, elevation_deg=25.0, yaw_rad=0.2), 12)


def fitted(evidence: Evidence, frame: Rigid3, size: np.ndarray) -> Cuboid | None:
    """The box fitted from an initial guess of that size, in a frame whose origin is at the carton's centre."""
    points = np.concatenate([masked_points(view) for view in evidence.pool])
    low, high = -size / 2, size / 2
    low[2] = 0.9 - MIDDLE[2]
    return fit_cuboid(frame.inverse.apply(points), low, high, evidence.pool, frame, ())


@pytest.mark.parametrize(("yaw", "scale"), [(0.0, 0.8), (0.5, 1.3)])
def test_the_box_fit_converges_from_small_large_and_rotated_boxes(carton: Evidence, yaw: float, scale: float) -> None:
    found = fitted(carton, Rigid3(rotation_about_z(yaw), MIDDLE), scale * SIZE)
    assert found is not None
    np.testing.assert_allclose(found.size_m, SIZE, atol=0.006)
    np.testing.assert_allclose(found.world_from_cuboid.translation, MIDDLE, atol=0.006)
    turn = np.arctan2(*found.world_from_cuboid.rotation[[1, 0], 0])
    assert turn == pytest.approx(0.2, abs=np.radians(1.5))
    assert (found.sigma_m < 0.006).all()


def test_observed_points_lie_on_the_fitted_surface(carton: Evidence) -> None:
    found = fitted(carton, Rigid3(np.eye(3), MIDDLE), SIZE)
    assert found is not None
    points = np.concatenate([masked_points(view) for view in carton.pool])
    assert np.median(np.abs(surface_distance(found, points))) < 0.006  # depth has 4 mm of noise


def test_two_views_give_no_box_fit(carton: Evidence) -> None:
    few = Evidence(capture=carton.capture, track=carton.track, pool=carton.pool[:2])
    assert fitted(few, Rigid3(np.eye(3), MIDDLE), SIZE) is None


def box(yaw: float = 0.0) -> Cuboid:
    return Cuboid(Rigid3(rotation_about_z(yaw), np.array([1.0, 2.0, 0.5])), np.array([0.4, 0.2, 0.6]), np.zeros(3), 0.0, 0.0)


@pytest.mark.parametrize("yaw", [0.0, 0.8])
def test_surface_distances_are_signed_and_follow_the_yaw_of_the_box(yaw: float) -> None:
    local = np.array([[0.0, 0, 0], [0.2, 0, 0], [0.3, 0, 0], [0.23, 0.14, 0], [0.0, 0.09, 0.0]])
    distances = surface_distance(box(yaw), box(yaw).world_from_cuboid.apply(local))
    np.testing.assert_allclose(distances, [-0.1, 0.0, 0.1, 0.05, -0.01], atol=1e-12)


def test_room_behind_is_the_distance_to_the_nearest_wall_behind() -> None:
    def wall(normal: tuple[float, float, float], distance_m: float) -> Wall:
        """A wall at that distance from the box's centre."""
        n = np.array(normal)
        return Wall(normal=n, offset_m=float(n @ [1.0, 2.0, 0.5]) - distance_m, area_m2=4.0)

    slack = 0.003  # a box may overlap a wall by this much
    behind, farther, beside = wall((0, -1, 0), 0.15), wall((0, -1, 0), 0.4), wall((1, 0, 0), 0.25)
    assert room_behind(box(), [behind]) == pytest.approx(0.05 + slack)
    assert room_behind(box(), [farther, behind, beside]) == pytest.approx(0.05 + slack)
    assert room_behind(box(), [beside]) == np.inf
    assert room_behind(box(), [wall((0, -1, 0), 0.05)]) == 0.0
