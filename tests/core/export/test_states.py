"""Reset states, and ranges for the randomisation of each parameter."""

import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from r2c2r_core.export import randomize
from r2c2r_core.export.contacts import ALLOWED_PENETRATION_M, overlapping
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.states import states_of
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.materials import SURFACE_FRICTION
from r2c2r_core.model.placement import Spread
from r2c2r_core.model.scene import ArticulatedScene
from r2c2r_core.schema.manifest import Manifest
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import bottle, cabinet, drawer, reconstruction
from tests.core.motions import motion

_UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("state", ["closed", "ajar", "open"])
def test_mujoco_keyframes_match_the_manifests_joint_states(good_folder: Path, state: str) -> None:
    said = json.loads((good_folder / "manifest.json").read_text())["states"][state]
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    data, still = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(state).id)
    mujoco.mj_forward(model, data)
    mujoco.mj_forward(model, still)
    assert len(said) == 4
    shut = {"double_1_left_hinge"} if state == "open" else set()  # the drawer beside it crosses its way
    for joint, position in said.items():
        share = 0.0 if joint in shut else {"closed": 0, "ajar": 0.15, "open": 1}[state]
        assert float(data.joint(joint).qpos[0]) == pytest.approx(position, abs=1e-8)
        assert position == pytest.approx(share * model.joint(joint).range[1])
    np.testing.assert_allclose(data.body("bottle_1_body").xpos, still.body("bottle_1_body").xpos, atol=1e-8)


def test_no_parts_overlap_or_move_in_any_keyframe(good_folder: Path) -> None:
    """The door beside the drawer opens by more than 90 degrees, into its way."""
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    assert deepest_m(model) < ALLOWED_PENETRATION_M
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("open").id)
    for _ in range(100):
        mujoco.mj_step(model, data)
    assert np.abs(data.qpos - model.key("open").qpos).max() < 1e-3  # rad or m


def test_a_door_that_hits_a_free_object_stays_closed_in_the_states(tmp_path: Path) -> None:
    obstacle = bottle("b", x=-0.36, bottom_z=0.0005)
    before = Rigid3(translation=obstacle.world_from_object.translation + np.array([0.0, -0.5, 0.0]))
    obstacle = replace(obstacle, world_from_object=before)
    scene = ArticulatedScene(name="t", objects=(cabinet("c"), obstacle, drawer("d", x=2.0)), layout_moves_m={}, warnings=())
    model = mujoco.MjModel.from_xml_path(str(write_folder(scene, tmp_path / "b") / "scene.xml"))
    assert deepest_m(model) < ALLOWED_PENETRATION_M
    assert {model.key(number).name for number in range(model.nkey)} == {"closed", "ajar", "open", "d_slide_open"}


def test_a_door_in_the_way_of_several_drawers_stays_closed_instead_of_them() -> None:
    scene = ArticulatedScene(
        name="t", objects=(cabinet("a"), drawer("b", x=1.0), drawer("c", x=2.0)), layout_moves_m={}, warnings=()
    )
    met = (("a_hinge", "b_slide"), ("a_hinge", "c_slide"))
    states = states_of(replace(plan_bundle(scene), conflicts={"open": met}))
    assert states["open"].joints == {"b_slide", "c_slide"}
    assert states["ajar"].joints == {"a_hinge", "b_slide", "c_slide"}
    assert states["a_hinge_open"].joints == {"a_hinge"}


def deepest_m(model: mujoco.MjModel) -> float:
    """Deepest overlap of the model's keyframes."""
    data, depths = mujoco.MjData(model), [0.0]
    for number in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, number)
        depths += [touch.depth_m for touch in overlapping(model, data)]
    return max(depths)


def test_each_joint_has_a_keyframe_that_opens_it_alone(good_folder: Path) -> None:
    said = json.loads((good_folder / "manifest.json").read_text())["states"]
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    assert {model.key(number).name for number in range(model.nkey)} == set(said)
    for joint in said["closed"]:
        assert {name for name, position in said[f"{joint}_open"].items() if position} == {joint}
        assert said[f"{joint}_open"][joint] == pytest.approx(model.joint(joint).range[1])


def test_an_asset_has_an_open_keyframe_for_its_own_joint(good_folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(good_folder / "assets/drawer_1/drawer_1.xml"))
    assert model.key("open").qpos[0] == pytest.approx(0.42)


def test_usd_joints_have_joint_state_and_newton_attributes(good_folder: Path) -> None:
    from pxr import Usd

    stage = Usd.Stage.Open(str(good_folder / "scene.usda"))
    slide = stage.GetPrimAtPath("/Scene/drawer_1/joints/drawer_1_slide")
    assert {"PhysicsJointStateAPI:linear", "NewtonJointAPI"} <= set(slide.GetPrimTypeInfo().GetAppliedAPISchemas())
    said = {a.GetName(): a.Get() for a in slide.GetAttributes()}
    assert said["state:linear:physics:position"] == 0.0
    assert (said["newton:friction"], said["mjc:frictionloss"]) == (1.0, 1.0)
    assert said["newton:armature"] == pytest.approx(0.02)


def test_manifest_values_lie_within_their_randomization_ranges(good_folder: Path) -> None:
    manifest = Manifest.model_validate_json((good_folder / "manifest.json").read_text())
    for item in manifest.objects:
        ranges = item.randomize
        assert ranges is not None
        assert ranges.mass_kg.low <= item.mass_kg <= ranges.mass_kg.high
        assert ranges.friction.low < SURFACE_FRICTION < ranges.friction.high
        for size, found in zip(item.dimensions_m, ranges.dimensions_m, strict=True):
            assert found.low <= size <= found.high
        for joint in item.joints:
            assert joint.randomize is not None
            assert joint.randomize.upper.low <= joint.upper <= joint.randomize.upper.high


def test_measured_spreads_are_normal_and_defaults_are_uniform() -> None:
    item = drawer("drawer_1")
    placement = reconstruction().placements[0]
    placement = replace(
        placement, spread=Spread(turn_deg=1.0, turn_axis_world=_UP, shift_m=0.002, shift_axis_world=_UP, scale=0.004)
    )
    width, depth, _ = randomize.of_object(item, 5.0, placement)["dimensions_m"]
    assert (width.distribution, width.source) == ("normal", "measured")
    assert width.sigma == pytest.approx(0.004 * item.dimensions_m[0])
    assert (depth.distribution, depth.source) == ("uniform", "default")
    assert depth.high - depth.low == pytest.approx(0.1 * item.dimensions_m[1])


def test_mass_ranges_are_sourced_and_joint_ranges_stop_at_obstacles() -> None:
    mass = randomize.of_object(bottle("bottle_1"), 0.9, None)["mass_kg"]
    assert (mass.low, mass.high, mass.source) == (0.2, 2.2, "sourced")
    (joint,) = cabinet("a").joints
    assert randomize.of_joint(joint)["upper"].high > joint.upper
    assert randomize.of_joint(replace(joint, uncut=2.0))["upper"].high == joint.upper
    filmed = replace(joint, motion=motion({3: joint.upper}, "left"), sources={**joint.sources, "limits": "at_least"})
    assert randomize.of_joint(filmed)["upper"].low == joint.upper  # it was seen to open as far
