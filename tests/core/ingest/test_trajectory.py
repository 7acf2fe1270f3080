"""Interpolation of a camera trajectory at image timestamps."""

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.ingest.readers.trajectory import Trajectory


def test_a_pose_between_two_samples_is_interpolated() -> None:
    path = Trajectory(np.array([0.0, 1.0]), (Rigid3(), Rigid3(rotation_about_z(0.2), np.array([1.0, 0.0, 0.0]))))
    found = path.at(0.5, apart_s=1.0, gap_s=2.0)
    assert found is not None
    np.testing.assert_allclose(found.rotation, rotation_about_z(0.1), atol=1e-9)
    np.testing.assert_allclose(found.translation, [0.5, 0.0, 0.0])


def test_next_to_an_invalid_pose_the_nearest_valid_pose_is_used() -> None:
    broken = Rigid3(np.full((3, 3), np.nan), np.zeros(3))
    path = Trajectory(np.array([0.0, 1.0]), (Rigid3(), broken))
    found = path.at(0.2, apart_s=1.0, gap_s=2.0)
    assert found is path.poses[0]
