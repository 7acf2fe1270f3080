import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.free_boxes import powell_box, smallest_box

SIZE = np.array([0.6, 0.4, 0.9])
TURNS = Rotation.random(12, rng=np.random.default_rng(3)).as_matrix()


@pytest.mark.parametrize("turn", TURNS)
def test_the_smallest_box_of_a_rotated_box_is_the_box_itself(turn: np.ndarray) -> None:
    found = smallest_box(box_corners(SIZE) @ turn.T + [1.0, 2.0, 3.0])
    assert sorted(found.size_m) == pytest.approx(sorted(SIZE), rel=1e-3)
    np.testing.assert_allclose(found.world_from_box.translation, [1, 2, 3], atol=1e-6)
    assert np.linalg.det(found.world_from_box.rotation) == pytest.approx(1.0)


def test_the_smallest_box_contains_all_points_and_matches_powells_volume() -> None:
    rng = np.random.default_rng(0)
    for turn in TURNS[:4]:
        points = (rng.normal(size=(300, 3)) * [0.3, 0.1, 0.5]) @ turn.T
        found = smallest_box(points)
        own = found.world_from_box.inverse.apply(points)
        assert (np.abs(own) <= found.size_m / 2 + 1e-9).all()
        assert found.volume_m3 <= powell_box(points).volume_m3 * 1.03


def test_powells_box_contains_all_points() -> None:
    points = box_corners(SIZE) @ TURNS[0].T
    found = powell_box(points, starts=2)
    assert (np.abs(found.world_from_box.inverse.apply(points)) <= found.size_m / 2 + 1e-9).all()
    assert found.volume_m3 >= SIZE.prod() * (1 - 1e-9)


def test_coplanar_points_raise() -> None:
    with pytest.raises(ValueError, match="one plane"):
        smallest_box(np.column_stack([np.random.default_rng(0).random((20, 2)), np.zeros(20)]))
