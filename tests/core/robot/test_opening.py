from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.robot.certificate import certify_with_gripper
from r2c2r_core.robot.grasps import best_way
from r2c2r_core.robot.opening import OPEN_SHARE, attempt, reset
from tests.core.robot.scenes import Bar, rig_and_travel, scene

LEVEL = Bar(wide=0.16, high=0.012)


@pytest.mark.parametrize(
    ("kind", "bar", "method"),
    [
        ("hinge", Bar(), "pinch"),
        ("hinge", LEVEL, "pinch"),
        ("drawer", LEVEL, "pinch"),
        ("sliding", Bar(), "pinch"),
        ("hinge", None, "push"),
        ("drawer", None, "push"),
        ("sliding", None, "drag"),
    ],
)
@pytest.mark.parametrize("turned", [0.0, pytest.param(2.5, marks=pytest.mark.slow)])
def test_the_gripper_opens_and_closes_graspable_fronts(
    tmp_path: Path, kind: str, bar: Bar | None, method: str, turned: float
) -> None:
    (grip,) = certify_with_gripper(scene(tmp_path, kind=kind, bar=bar, turned=turned)).grips
    assert grip.passed, grip
    assert grip.method == method
    assert grip.opened >= OPEN_SHARE
    assert grip.left_open <= 0.02


def test_the_gripper_opens_and_closes_a_rotated_drawer(tmp_path: Path) -> None:
    (grip,) = certify_with_gripper(scene(tmp_path, kind="drawer", bar=LEVEL, turned=2.5)).grips
    assert grip.passed, grip
    assert grip.method == "pinch"


def test_only_pad_friction_holds_the_handle(tmp_path: Path) -> None:
    """With nearly frictionless pads the gripper slips off a flat-sided bar: no weld holds the handle."""
    rig, travel = rig_and_travel(scene(tmp_path, kind="drawer", bar=LEVEL))
    way = best_way(rig, travel)
    assert way is not None
    for geom in rig.pads:
        rig.model.geom_friction[geom] = 0.005
    reset(rig)
    assert attempt(rig, travel, way).opened < 0.1


def test_the_gripper_force_is_limited_to_its_maximum(tmp_path: Path) -> None:
    (grip,) = certify_with_gripper(scene(tmp_path, kind="drawer", bar=LEVEL, frictionloss=400.0)).grips
    assert not grip.passed
    assert grip.opened < 0.2  # MuJoCo's dry friction creeps under a steady pull
    assert grip.force_n <= np.sqrt(3) * 80.0 + 1e-6


@pytest.mark.parametrize("ends", ["0.3 1.2", "-1.57 0"])
def test_a_joint_that_cannot_open_from_closed_is_no_failure_of_the_gripper(tmp_path: Path, ends: str) -> None:
    path = scene(tmp_path, kind="hinge", bar=Bar())
    path.write_text(path.read_text().replace('range="0 1.92"', f'range="{ends}"'))
    (grip,) = certify_with_gripper(path).grips
    assert (grip.passed, grip.blame) == (False, None)
    assert f"front_joint: its range is {ends.replace(' ', ' .. ')}; 0 is closed" in grip.why


def test_a_stiff_joint_is_reported_as_the_reason(tmp_path: Path) -> None:
    (grip,) = certify_with_gripper(scene(tmp_path, kind="hinge", bar=Bar(), frictionloss=60.0)).grips
    assert not grip.passed
    assert "stiff" in grip.why or "slipped" in grip.why
    assert grip.grip_n == 40.0


def test_a_handle_thicker_than_the_gripper_stroke_is_reported(tmp_path: Path) -> None:
    (grip,) = certify_with_gripper(scene(tmp_path, bar=Bar(wide=0.12, high=0.12))).grips
    assert (grip.passed, grip.blame) == (False, "scan")
    assert grip.why == "handle too thick: 120 mm wide and 120 mm high, the gripper opens 80 mm"


def test_a_protrusion_not_shaped_as_a_bar_is_not_a_handle(tmp_path: Path) -> None:
    path = scene(tmp_path, bar=Bar())
    _, travel = rig_and_travel(path)
    assert travel.part.bar is not None
    np.testing.assert_allclose(travel.part.bar.size, (0.012, 0.01, 0.16))
    path.write_text(path.read_text().replace('name="handle" type="box"', 'name="handle" type="sphere"'))
    _, travel = rig_and_travel(path)
    assert travel.part.bar is None


def test_a_blocking_obstacle_is_reported_by_name(tmp_path: Path) -> None:
    post = '<body name="post" pos="-0.16 -0.36 0"><geom size="0.3 0.01 0.4"/></body>'
    (grip,) = certify_with_gripper(scene(tmp_path, bar=Bar(), beside=post)).grips
    assert (grip.passed, grip.blame) == (False, "world")
    assert grip.why.startswith("blocked by post")


def test_a_handle_beside_the_hinge_is_the_reason_for_a_blocked_grasp(tmp_path: Path) -> None:
    post = '<body name="post" pos="-0.16 -0.36 0"><geom size="0.3 0.01 0.4"/></body>'
    path = scene(tmp_path, bar=Bar(), beside=post)
    path.write_text(path.read_text().replace('axis="0 0 1" pos="0.2', 'axis="0 0 -1" pos="-0.2'))
    (grip,) = certify_with_gripper(path).grips
    assert (grip.passed, grip.blame) == (False, "scan")
    assert grip.why.startswith("handle beside the hinge, 59 mm away: the gripper collides with post")


def test_an_obstacle_that_only_the_part_hits_is_reported_by_name(tmp_path: Path) -> None:
    post = '<body name="post" pos="-0.1 -0.5 -0.2"><geom size="0.03 0.03 0.04"/></body>'
    (grip,) = certify_with_gripper(scene(tmp_path, bar=Bar(), beside=post)).grips
    assert (grip.passed, grip.blame) == (False, "scan")
    assert grip.why.startswith("its part hits post as it opens; opens")


def test_a_blocked_wrist_lets_the_bar_rotate_in_the_grip(tmp_path: Path) -> None:
    """A level bar on a vertical hinge: a wall blocks the wrist, so its rotation lags and the bar turns in the pads."""
    free, travel = rig_and_travel(scene(tmp_path, bar=LEVEL))
    way = best_way(free, travel)
    assert way is not None
    assert way.opens.follow == 1.0
    wall = '<body name="wall" pos="0.42 -0.6 0"><geom size="0.01 0.3 0.5"/></body>'
    rig, travel = rig_and_travel(scene(tmp_path, bar=LEVEL, beside=wall))
    way = best_way(rig, travel)
    assert way is not None
    assert way.opens.follow < 1.0


def test_the_gripper_certificate_is_deterministic(tmp_path: Path) -> None:
    path = scene(tmp_path, bar=Bar())
    assert certify_with_gripper(path) == certify_with_gripper(path)
