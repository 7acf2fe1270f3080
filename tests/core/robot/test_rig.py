from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.robot.rig import axes_of, pose_of
from tests.core.robot.scenes import Bar, rig_and_travel, scene


@pytest.mark.parametrize("seed", range(8))
def test_a_pose_round_trips_through_the_six_rig_axes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose = Rigid3(Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3))
    axes = axes_of(pose, near_yaw=3 * np.pi)
    assert abs(axes[3] - 3 * np.pi) <= np.pi + 1e-9
    np.testing.assert_allclose(pose_of(axes).rotation, pose.rotation, atol=1e-9)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_at_gimbal_lock_the_yaw_is_kept_and_the_roll_compensates(pitch: float) -> None:
    pose = pose_of(np.array([0, 0, 0, 0.7, pitch, 0.4]))
    axes = axes_of(pose, near_yaw=0.2)
    assert axes[3] == pytest.approx(0.2)
    np.testing.assert_allclose(pose_of(axes).rotation, pose.rotation, atol=1e-6)


def test_the_tool_is_at_the_requested_pose(tmp_path: Path) -> None:
    rig, _ = rig_and_travel(scene(tmp_path))
    pose = pose_of(np.array([0.3, -0.9, 0.7, 1.2, 0.3, -0.8]))
    rig.put(pose, 0.05)
    mujoco.mj_kinematics(rig.model, rig.data)
    np.testing.assert_allclose(rig.world_from_tool.matrix, pose.matrix, atol=1e-9)
    assert rig.width_m == pytest.approx(0.05)


@pytest.mark.parametrize("kind", ["hinge", "drawer", "sliding"])
def test_the_computed_part_pose_matches_mujoco(tmp_path: Path, kind: str) -> None:
    rig, travel = rig_and_travel(scene(tmp_path, kind=kind, bar=Bar(), turned=0.6))
    rig.data.qpos[travel.address] = 0.6 * travel.upper
    mujoco.mj_kinematics(rig.model, rig.data)
    expected = travel.world_from_body(0.6 * travel.upper).matrix
    np.testing.assert_allclose(rig.world_from_body(travel.part.body).matrix, expected, atol=1e-9)
