import numpy as np
import pytest

from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.gaps import last_contact

UP, ALONG = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


def cube(x: float = 0.0, z: float = 0.0) -> np.ndarray:
    return box_corners(np.array([0.2, 0.2, 0.2])) + np.array([x, 0.0, z])


def test_a_cube_leaves_another_after_its_overlap_and_its_size() -> None:
    assert last_contact(cube(z=0.15), cube(), UP) == pytest.approx(0.05)
    assert last_contact(cube(x=0.05), cube(), ALONG) == pytest.approx(0.15)


def test_a_cube_beyond_another_left_it_before_and_one_beside_never_meets_it() -> None:
    assert last_contact(cube(z=0.23), cube(), UP) == pytest.approx(-0.03)
    assert last_contact(cube(x=0.3), cube(), UP) is None


def test_a_tilted_top_is_met_where_the_foot_stands() -> None:
    top = np.array([[x, y, z + 0.1 * x] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-0.1, 0.0)])
    assert last_contact(cube(x=-0.5, z=0.1), top, UP) == pytest.approx(-0.04)  # the nearest corner is at x = -0.4
