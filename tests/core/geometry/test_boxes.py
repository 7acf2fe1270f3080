import numpy as np
import pytest

from r2c2r_core.geometry.boxes import (
    Boxes,
    box_at_yaw,
    box_corners,
    box_penetration,
    right_angle_yaw,
    smallest_rectangle,
    upright_box,
)
from r2c2r_core.geometry.transforms import nearest_rotation, rotation_about_z

SIZE = np.array([0.6, 0.4, 0.9])


def yawed(points: np.ndarray, yaw: float) -> np.ndarray:
    return points @ rotation_about_z(yaw).T + [0.3, -0.2, 0.5]


@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.0, 2.0, -0.7])
def test_the_upright_box_of_a_yawed_box_is_the_box_itself(yaw: float) -> None:
    found = upright_box(yawed(box_corners(SIZE), yaw))
    assert sorted(found.size_m) == pytest.approx(sorted(SIZE))
    np.testing.assert_allclose(found.world_from_box.translation, [0.3, -0.2, 0.5], atol=1e-9)
    corners = found.world_from_box.apply(box_corners(found.size_m))
    truth = yawed(box_corners(SIZE), yaw)
    assert np.linalg.norm(corners[:, None] - truth[None], axis=2).min(axis=1).max() < 1e-9


def test_trimming_excludes_outliers_from_the_box() -> None:
    rng = np.random.default_rng(0)
    points = np.vstack([(rng.random((5000, 3)) - 0.5) * SIZE, [[0.0, -0.4, 0.0]] * 10])
    np.testing.assert_allclose(box_at_yaw(points, 0.0, trim=0.004).size_m, SIZE, atol=0.01)


@pytest.mark.parametrize("yaw", [0.1, 0.8, 1.5])
def test_right_angle_yaw_is_recovered_from_normals(yaw: float) -> None:
    normals = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1.0]]) @ rotation_about_z(yaw).T
    assert right_angle_yaw(normals) == pytest.approx(yaw % (np.pi / 2), abs=1e-9)


def test_the_smallest_rectangle_of_a_rotated_rectangle_is_itself() -> None:
    corners = np.array([[-0.3, -0.2], [0.3, -0.2], [0.3, 0.2], [-0.3, 0.2]]) @ rotation_about_z(0.4)[:2, :2].T + [1, 2]
    found = smallest_rectangle(corners)
    assert sorted(found.size) == pytest.approx([0.4, 0.6])
    np.testing.assert_allclose(found.centre, [1, 2])


def boxes(centre: np.ndarray, axes: np.ndarray, size: np.ndarray) -> Boxes:
    return Boxes(centre[None], axes[None], size[None] / 2)


@pytest.mark.parametrize("gap", [-0.01, 0.01])
def test_penetration_along_an_axis_equals_the_overlap(gap: float) -> None:
    turn = rotation_about_z(0.5)
    a = boxes(np.zeros(3), turn, SIZE)
    b = boxes(turn @ np.array([0.6 + gap, 0.0, 0.0]), turn, SIZE)
    assert box_penetration(a, b)[0] == pytest.approx(-gap)


def test_crossed_bars_are_separated_by_an_edge_cross_product_axis() -> None:
    """Two perpendicular bars, rotated so that only a cross product of edges separates them."""
    rolled = np.array([[1, 0, 0], [0, 0.5**0.5, -(0.5**0.5)], [0, 0.5**0.5, 0.5**0.5]])
    bar = np.array([1.0, 0.1, 0.1])
    a = boxes(np.zeros(3), rolled, bar)
    b = boxes(np.array([0.0, 0.0, 0.16]), rotation_about_z(np.pi / 2) @ a.axes[0], bar)
    assert box_penetration(a, b)[0] < 0
    assert box_penetration(a, Boxes(b.centres - [0, 0, 0.05], b.axes, b.halves))[0] > 0


def test_penetration_is_symmetric_and_frame_independent() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        ra, rb, r = (nearest_rotation(rng.normal(size=(3, 3))) for _ in range(3))
        ca, cb, shift = rng.normal(size=(3, 3)) * 0.3
        a, b = boxes(ca, ra, SIZE), boxes(cb, rb, SIZE[::-1])
        moved_a, moved_b = boxes(r @ ca + shift, r @ ra, SIZE), boxes(r @ cb + shift, r @ rb, SIZE[::-1])
        forward = box_penetration(a, b)[0]
        assert forward == pytest.approx(box_penetration(b, a)[0])
        assert forward == pytest.approx(box_penetration(moved_a, moved_b)[0])
