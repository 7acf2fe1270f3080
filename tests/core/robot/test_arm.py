import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest
import shapely

from r2c2r_core.errors import BackendUnavailable
from r2c2r_core.robot import panda
from r2c2r_core.robot.arm import Stand
from r2c2r_core.robot.arm_certificate import ArmCertificate, arm_to_json, certify_with_arm
from r2c2r_core.robot.kinematics import Chain, chain_of, placed, solve
from r2c2r_core.robot.standing import Floor, Reach, fewest_places
from r2c2r_core.robot.standing_map import standing_svg
from tests.core.robot.scenes import Bar, scene

pytest.importorskip("pybullet_data", reason="the arm's description is in pybullet's wheel")
HERE, THERE = Stand(0.0, -1.0, 1.5, 0.4), Stand(1.0, -1.0, 1.5, 0.4)


@pytest.fixture(scope="module")
def panda_model() -> mujoco.MjModel:
    return panda.panda_spec().compile()


@pytest.fixture(scope="module")
def chain(panda_model: mujoco.MjModel) -> Chain:
    return chain_of(panda_model, panda.JOINTS, "tool", panda.RESTS)


def test_forward_kinematics_and_jacobian_match_mujoco(panda_model: mujoco.MjModel, chain: Chain) -> None:
    data, jacobian = mujoco.MjData(panda_model), np.zeros((6, panda_model.nv))
    for angles in np.random.default_rng(0).uniform(chain.low, chain.high, (5, 7)):
        data.qpos[:7] = angles
        mujoco.mj_forward(panda_model, data)
        mujoco.mj_jacSite(panda_model, data, jacobian[:3], jacobian[3:], panda_model.site("tool").id)
        now = placed(chain, angles[None])
        np.testing.assert_allclose(now.base_from_tool[0, :3, 3], data.site("tool").xpos, atol=1e-9)
        np.testing.assert_allclose(now.base_from_tool[0, :3, :3].ravel(), data.site("tool").xmat, atol=1e-7)
        np.testing.assert_allclose(now.jacobian[0], jacobian[:, :7], atol=1e-7)


def test_inverse_kinematics_recovers_poses_within_joint_limits(chain: Chain) -> None:
    middle, span = (chain.low + chain.high) / 2, chain.high - chain.low
    angles = middle + 0.25 * span * np.random.default_rng(1).uniform(-1, 1, (50, 7))
    found = solve(chain, placed(chain, angles).base_from_tool, angles + 0.15, 40)
    assert ((found.off_m < 1e-3) & (found.off_rad < 5e-3)).mean() > 0.95
    far = np.eye(4)[None].repeat(3, axis=0) * [2.0, 1.0, 1.0, 1.0]
    far[:, 0, 3] = 5.0
    out = solve(chain, far, angles[:3], 20)
    assert (out.off_m > 1.0).all()
    assert ((out.angles >= chain.low) & (out.angles <= chain.high)).all()


@pytest.mark.parametrize(
    ("kind", "bar"), [pytest.param("drawer", Bar(wide=0.16, high=0.012), marks=pytest.mark.slow), ("hinge", Bar())]
)
def test_an_arm_opens_and_closes_a_drawer_and_a_door(tmp_path: Path, kind: str, bar: Bar) -> None:
    found = certify_with_arm(scene(tmp_path, kind=kind, bar=bar))
    (grip,) = found.grips
    assert grip.passed, grip
    assert grip.opened >= 0.9
    assert grip.left_open <= 0.02
    (stand,) = found.places
    assert found.floor.furniture.distance(shapely.Point(stand[:2])) > panda.PEDESTAL_RADIUS_M
    told = arm_to_json(found)
    assert (told["joints_opened"], told["joints_in_reach"], told["joints"]) == (1, 1, 1)
    assert told["reached_from"]["front_joint"] >= 1
    assert "Apache-2.0" in told["arm"]["source"]


def test_a_walled_in_drawer_is_unreachable_for_the_arm(tmp_path: Path) -> None:
    walls = '<body name="walls" pos="0 -0.75 0"><geom size="1.5 0.05 0.8"/></body>'
    (grip,) = certify_with_arm(scene(tmp_path, kind="drawer", bar=Bar(wide=0.16, high=0.012), beside=walls)).grips
    assert (grip.passed, grip.blame) == (False, "arm")
    assert grip.why == "no place on the floor lets the arm reach the whole motion"


def test_the_fewest_base_positions_are_chosen_preferring_the_easiest() -> None:
    reached = {
        "a": {HERE: _reach(0.01), THERE: _reach(0.03)},
        "b": {HERE: _reach(0.01), THERE: _reach(0.02)},
        "c": {THERE._replace(x_m=3.0): _reach(0.05)},
        "d": {},
    }
    assert fewest_places(reached) == {THERE: ["a", "b"], THERE._replace(x_m=3.0): ["c"]}


def test_the_base_map_shows_furniture_positions_and_unreachable_joints() -> None:
    floor = Floor(stands=(HERE, THERE), furniture=shapely.box(-1.0, 0.0, 1.0, 0.6))
    svg = standing_svg(floor, {"a<b": {HERE: _reach(0.1)}, "far": {}}, {HERE: ("a<b",)})
    page = ET.fromstring(svg)
    texts = ["".join(element.itertext()) for element in page.iter("{http://www.w3.org/2000/svg}text")]
    assert "1: x 0.0, y -1.0 m, lifted 0.4 m: a<b" in texts
    assert "out of reach: far" in texts
    assert len(list(page.iter("{http://www.w3.org/2000/svg}polygon"))) == 1


def test_a_floor_without_base_positions_still_has_a_map() -> None:
    ET.fromstring(standing_svg(Floor(stands=(), furniture=shapely.union_all([])), {"a": {}}, {}))


def test_without_the_arm_extra_the_error_names_the_package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(BackendUnavailable) as raised:
        certify_with_arm(scene(tmp_path))
    assert "r2c2r[arm]" in (raised.value.hint or "")


def _reach(ease: float) -> Reach:
    return Reach(np.zeros(7), False, ease)


def test_a_bundle_without_joints_is_certified(tmp_path: Path) -> None:
    (tmp_path / "scene.xml").write_text('<mujoco><worldbody><geom type="box" size="1 1 1"/></worldbody></mujoco>')
    found = certify_with_arm(tmp_path / "scene.xml")
    assert isinstance(found, ArmCertificate)
    assert found.grips == ()
