import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.export.writers.text import numbers, quat_wxyz_of, rotation_of, rpy_of


@pytest.mark.parametrize("seed", range(20))
def test_rpy_and_rotation_are_inverse(seed: int) -> None:
    rotation = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    np.testing.assert_allclose(rotation_of(rpy_of(rotation)), rotation, atol=1e-9)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_rpy_is_correct_at_gimbal_lock(pitch: float) -> None:
    rotation = rotation_of([0.3, pitch, 0.8])
    np.testing.assert_allclose(rotation_of(rpy_of(rotation)), rotation, atol=1e-9)


def test_rpy_is_the_urdf_convention() -> None:
    """Fixed axes x, then y, then z."""
    expected = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix()
    np.testing.assert_allclose(rotation_of([0.1, 0.2, 0.3]), expected, atol=1e-12)


def test_quaternions_have_w_first() -> None:
    np.testing.assert_allclose(quat_wxyz_of(np.eye(3)), [1, 0, 0, 0], atol=1e-12)
    quarter = quat_wxyz_of(rotation_of([0, 0, np.pi / 2]))
    np.testing.assert_allclose(quarter, [np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-12)


def test_numbers_have_no_negative_zero() -> None:
    assert numbers([-0.0, 1e-15, -1.5]) == "0 0 -1.5"
