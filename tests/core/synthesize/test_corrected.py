"""Immediate geometric preview of a correction without a run."""

import numpy as np
import pytest

from r2c2r_core.model.inputs import JointLimits, ObjectOverride
from r2c2r_core.synthesize.corrected import corrected, differs
from tests.core.export.kitchen import cabinet, drawer


def test_flipping_a_hinge_mirrors_its_axis_to_the_other_edge() -> None:
    left = cabinet("cabinet_1")
    right = corrected(left, ObjectOverride(hinge="right"), ())
    (before,), (after,) = left.joints, right.joints
    assert after.origin_object[0] == pytest.approx(-before.origin_object[0])
    assert np.allclose(after.axis_object, -before.axis_object)
    assert after.origin_object[1] == pytest.approx(-left.dimensions_m[1] / 2)  # the outer face of the front
    assert differs(left, right)
    assert not differs(left, corrected(right, ObjectOverride(hinge="left"), ()))


def test_corrections_equal_to_the_last_run_change_nothing() -> None:
    item = cabinet("cabinet_1")
    said = ObjectOverride(
        hinge="left", dimensions_m=item.dimensions_m, pose=item.world_from_object.matrix, joint_upper=item.joints[0].upper
    )
    assert not differs(item, corrected(item, said, ()))


def test_a_size_correction_scales_boxes_and_joints_and_a_pose_moves_them() -> None:
    item = cabinet("cabinet_1")
    wider = corrected(item, ObjectOverride(dimensions_m=item.dimensions_m * np.array([2.0, 1.0, 1.0])), ())
    assert wider.joints[0].origin_object[0] == pytest.approx(2 * item.joints[0].origin_object[0])
    fronts = [next(link for link in one.links if link.name == "cabinet_1_door").of_role("front")[0] for one in (item, wider)]
    assert fronts[1].size_m[0] == pytest.approx(2 * fronts[0].size_m[0])
    pose = np.eye(4)
    pose[0, 3] = 3.0
    assert np.allclose(corrected(item, ObjectOverride(pose=pose), ()).world_from_object.translation, [3.0, 0.0, 0.0])


def test_limits_apply_to_a_single_joint_or_by_joint_name() -> None:
    item = drawer("drawer_1")
    assert corrected(item, ObjectOverride(joint_upper=0.1), ()).joints[0].upper == 0.1
    name = item.joints[0].name
    assert corrected(item, ObjectOverride(joints={name: JointLimits(None, 0.2)}), ()).joints[0].upper == 0.2


def test_a_hinge_correction_of_a_drawer_is_ignored() -> None:
    item = drawer("drawer_1")
    assert not differs(item, corrected(item, ObjectOverride(hinge="right"), ()))
