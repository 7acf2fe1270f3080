"""MuJoCo simulation as the oracle, with kitchens of known defects."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from r2c2r_core.export import simulate as simulation
from r2c2r_core.export.contacts import touches
from r2c2r_core.export.simulate import compiled, simulate
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.scene import ArticulatedScene, Box, SceneObject
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import bottle, cabinet, counter, double_door, drawer, kitchen
from tests.core.synthesize.kitchen_units import Handle, Unit
from tests.core.synthesize.test_build_scene import built

DEPTH_TOLERANCE_M = 5e-4


def simulated(tmp_path: Path, *objects: SceneObject):
    scene = ArticulatedScene(name="t", objects=objects, layout_moves_m={}, warnings=())
    return simulate(write_folder(scene, tmp_path / "bundle") / "scene.xml")


def moved(item: SceneObject, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> SceneObject:
    pose = Rigid3(item.world_from_object.rotation, item.world_from_object.translation + np.array([x, y, z]))
    return replace(item, world_from_object=pose)


def test_the_good_kitchen_opens_fully_without_penetration(tmp_path: Path) -> None:
    result = simulate(write_folder(kitchen(), tmp_path / "b") / "scene.xml")
    assert [(f.rule, f.where) for f in result.findings] == [("together", "drawer_1_slide")]  # beside a door open by 92 degrees
    assert {joint.joint for joint in result.joints} == {
        "cabinet_1_hinge",
        "drawer_1_slide",
        "double_1_left_hinge",
        "double_1_right_hinge",
    }
    for joint in result.joints:
        assert joint.travel_reached >= 0.98
        assert joint.deepest_penetration_m == 0.0
    assert result.rest_penetration_m == 0.0
    assert result.most_drift_m < 5e-4  # the bottle settles through a tenth of a millimetre
    assert result.realtime_factor > 1.0


def test_a_wide_flap_opens_under_a_hands_force_and_stays_where_it_is_let_go(tmp_path: Path) -> None:
    """Gas stays carry such leaves: at 10 kg, gravity alone would stop the hand at 64 % of its travel."""
    unit = Unit("flap", "wall_cabinet", (0, 0, 1.8), (1.0, 0.35, 0.86), handle=Handle(0.0, -0.38, vertical=False))
    scene = write_folder(built(unit), tmp_path / "b") / "scene.xml"
    result = simulate(scene)
    assert [joint.travel_reached for joint in result.joints] == [1.0]
    assert result.findings == ()
    model = compiled(scene)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ajar").id)
    ajar = data.qpos.copy()
    mujoco.mj_step(model, data, nstep=round(1.0 / model.opt.timestep))
    np.testing.assert_allclose(data.qpos, ajar, atol=1e-3)
    assert "<gravity>false</gravity>" in (scene.parent / "scene.sdf").read_text()
    assert "bool physxRigidBody:disableGravity = 1" in (scene.parent / "assets/flap/flap.usda").read_text()


def test_a_scene_with_undecodable_names_is_one_compile_finding(tmp_path: Path) -> None:
    """MuJoCo compiles such a model; its Python bindings then fail on every name."""
    scene = write_folder(kitchen(), tmp_path / "b") / "scene.xml"
    scene.write_bytes(scene.read_bytes().replace(b"bottle_1", b"bottle\xf51"))
    result = simulate(scene)
    assert [f.rule for f in result.findings] == ["mjcf-compile"]


def test_a_diverging_scene_writes_no_mujoco_log_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo appends warnings to MUJOCO_LOG.TXT in the working folder unless a warning handler is installed."""
    monkeypatch.chdir(tmp_path)
    Path("scene.xml").write_text(
        '<mujoco><worldbody><body name="b"><freejoint/><geom size="1" mass="1"/></body></worldbody></mujoco>'
    )
    model = compiled(Path("scene.xml"))
    data = mujoco.MjData(model)
    data.qvel[:] = np.nan
    mujoco.mj_step(model, data)
    assert data.warning[int(mujoco.mjtWarning.mjWARN_BADQVEL)].number == 1
    assert [path.name for path in tmp_path.iterdir()] == ["scene.xml"]


def test_a_door_without_a_gap_to_its_neighbours_jams(tmp_path: Path) -> None:
    """Fronts that touch exactly do not penetrate in the sweep's first pose, but friction blocks the door."""
    jammed = [cabinet(f"c_{k}", x=0.6 * k, front_gap_m=0.0, gap_m=0.0) for k in range(3)]
    result = simulated(tmp_path, *jammed)
    assert min(joint.travel_reached for joint in result.joints) < 0.98
    assert "travel" in {f.rule for f in result.findings}


@pytest.mark.parametrize("depth_m", [0.002, 0.01, 0.03])
def test_a_drawer_hitting_an_obstacle_is_reported_with_its_depth(tmp_path: Path, depth_m: float) -> None:
    """A post stands `depth_m` inside the open drawer's last stretch of travel."""
    item = drawer("d")
    front_y = -0.56 / 2 - 0.03  # y of the handle's outer face, closed
    post = counter("post")
    size = np.array([0.1, 0.1, 0.4])
    link = replace(post.links[0], boxes=(Box(name="post", role="carcass", size_m=size, link_from_box=Rigid3()),))
    inertia = replace(link.inertial, inertia=np.diag([1.0, 1.0, 1.0]), mass_kg=20.0, com_link=np.zeros(3))
    at = np.array([0.0, front_y - item.joints[0].upper - 0.05 + depth_m, 0.7])
    post = replace(post, dimensions_m=size, links=(replace(link, inertial=inertia),), world_from_object=Rigid3(np.eye(3), at))
    result = simulated(tmp_path, item, post)
    assert result.joints[0].deepest_penetration_m == pytest.approx(depth_m, abs=DEPTH_TOLERANCE_M)
    assert "penetration-sweep" in {f.rule for f in result.findings}


@pytest.mark.parametrize("depth_m", [0.001, 0.004, 0.012])
def test_a_door_overlapping_its_neighbour_is_reported_at_rest(tmp_path: Path, depth_m: float) -> None:
    first, second = cabinet("a"), cabinet("b", x=0.6 - 0.003 - depth_m)
    result = simulated(tmp_path, first, second)
    assert result.rest_penetration_m == pytest.approx(depth_m, abs=DEPTH_TOLERANCE_M)
    assert "penetration-rest" in {f.rule for f in result.findings}


def test_door_carcass_penetration_is_measured_despite_contact_exclusion(tmp_path: Path) -> None:
    result = simulated(tmp_path, cabinet("a", gap_m=-0.005))
    assert result.rest_penetration_m == pytest.approx(0.005, abs=DEPTH_TOLERANCE_M)


def test_an_object_sunk_into_the_counter_is_measured_with_its_depth(tmp_path: Path) -> None:
    result = simulated(tmp_path, counter("counter_1"), bottle("b", bottom_z=0.865 - 0.03))
    assert result.rest_penetration_m == pytest.approx(0.03, abs=DEPTH_TOLERANCE_M)


@pytest.mark.parametrize("off_m", [-0.015, -0.003, 0.004, 0.011])
def test_a_small_gap_or_overlap_with_the_support_is_corrected(tmp_path: Path, off_m: float) -> None:
    """The counter's top is at 0.865 m; scan errors of millimetres neither sink the bottle nor let it drop."""
    result = simulated(tmp_path, counter("counter_1"), bottle("b", bottom_z=0.865 + off_m))
    assert result.findings == ()
    assert result.rest_penetration_m == 0.0
    assert result.most_drift_m < 5e-4


def test_an_obstacle_in_front_of_a_door_is_a_warning_only(tmp_path: Path) -> None:
    result = simulated(tmp_path, cabinet("c"), moved(bottle("b", x=0.1, bottom_z=0.0005), y=-0.35, z=0.0))
    assert {(f.rule, f.severity, f.where) for f in result.findings} == {("blocked-by", "warning", "c_hinge")}
    (blocker,) = result.joints[0].blocked_by
    assert (blocker.name, blocker.kind) == ("b_body", "thing")
    assert 0.0 < blocker.position < 1.0  # it is 1 cm before the closed door's path, near its free edge
    assert result.joints[0].travel_reached >= 0.98


def test_an_unsupported_object_that_falls_is_reported_as_drift(tmp_path: Path) -> None:
    """At the counter's edge: a third of the bottle's base is supported, its centre of mass is not."""
    result = simulated(tmp_path, counter("k"), bottle("b", bottom_z=0.9))
    assert "drift" not in {f.rule for f in result.findings}  # a support plate carries it
    scene = ArticulatedScene(
        name="t",
        objects=(counter("k"), moved(bottle("b"), y=-0.235)),  # 5 mm of its base still inside the edge, in plan
        layout_moves_m={},
        warnings=(),
    )
    folder = write_folder(scene, tmp_path / "falling")
    text = (folder / "scene.xml").read_text()
    assert "b_support" in text
    scene_xml = folder / "scene.xml"
    scene_xml.write_text(_without_body(text, "b_support"))
    found = simulate(scene_xml)
    assert {f.rule for f in found.findings} == {"drift"}
    assert found.most_drift_m > 0.5


def test_an_object_that_hangs_in_the_air_is_named_with_its_gap(tmp_path: Path) -> None:
    scene = ArticulatedScene(name="t", objects=(counter("k"), bottle("b", bottom_z=0.91)), layout_moves_m={}, warnings=())
    scene_xml = write_folder(scene, tmp_path / "hanging") / "scene.xml"
    if "b_support" in (text := scene_xml.read_text()):
        scene_xml.write_text(_without_body(text, "b_support"))
    found = simulate(scene_xml)
    assert [(f.rule, f.message) for f in found.findings] == [("hover", "hangs 45 mm over k_slab")]
    assert found.most_drift_m > 0.03


def test_fixed_parts_that_overlap_are_a_warning(tmp_path: Path) -> None:
    result = simulated(tmp_path, counter("a"), moved(counter("b"), z=0.02))
    assert {(f.rule, f.severity) for f in result.findings} == {("overlap", "warning")}


def test_a_scene_mujoco_cannot_compile_gives_one_finding(tmp_path: Path) -> None:
    folder = write_folder(kitchen(), tmp_path / "b")
    scene = folder / "scene.xml"
    scene.write_text(scene.read_text().replace('type="box"', 'type="bx"', 1))
    result = simulate(scene)
    assert [f.rule for f in result.findings] == ["mjcf-compile"]
    assert np.isnan(result.most_drift_m)


def test_a_diverging_scene_has_no_drift_instead_of_none(tmp_path: Path) -> None:
    """Its positions are NaN, which is neither small nor large."""
    (tmp_path / "scene.xml").write_text(
        """<mujoco><option gravity="0 0 -1e300"><flag autoreset="disable"/></option><worldbody>
        <body name="a"><freejoint/><geom size="0.1"/></body><body name="b" pos="1 0 0"><geom size="0.1"/></body>
        </worldbody></mujoco>"""
    )
    result = simulate(tmp_path / "scene.xml")
    assert np.isnan(result.drift_m["a"])
    assert result.drift_m["b"] == 0
    assert np.isnan(result.most_drift_m)
    assert {"drift", "unstable"} <= {f.rule for f in result.findings}


def test_the_good_kitchen_has_no_contacts(tmp_path: Path) -> None:
    folder = write_folder(kitchen(), tmp_path / "b")
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    assert touches(model, {}) == []


def test_a_touch_is_the_deepest_contact_of_its_pair_and_the_deepest_pair_is_first() -> None:
    """Three balls of one body are 5, 12 and 8 mm deep in a block, the ball of another body is 20 mm deep in it."""

    def ball(x: float, depth_m: float) -> str:
        return f'<geom type="sphere" size="0.05" pos="{x} 0 {0.15 - depth_m}"/>'

    bodies = {
        "block": '<geom type="box" size="0.5 0.1 0.1"/>',
        "three": ball(-0.4, 0.005) + ball(-0.2, 0.012) + ball(0.0, 0.008),
        "one": ball(0.3, 0.02),
    }
    text = "".join(f'<body name="{name}"><freejoint/>{geoms}</body>' for name, geoms in bodies.items())
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{text}</worldbody></mujoco>")
    found = touches(model, {})
    assert [touch.names for touch in found] == ["one and block", "three and block"]
    assert [touch.depth_m for touch in found] == pytest.approx([0.02, 0.012], abs=1e-6)


def _without_body(text: str, name: str) -> str:
    import xml.etree.ElementTree as ET

    root = ET.fromstring(text)
    world = root.find("worldbody")
    world.remove(next(body for body in world if body.get("name") == name))
    return ET.tostring(root, encoding="unicode")


def test_doors_that_collide_when_both_are_open_are_a_warning(tmp_path: Path) -> None:
    """Two cabinets facing each other 0.8 m apart: each opens fully, their doors cross."""
    turned = Rigid3(np.diag([-1.0, -1.0, 1.0]), np.array([0.1, -0.56 - 0.8, 0.0]))
    facing = cabinet("b")
    facing = replace(facing, world_from_object=turned @ facing.world_from_object)
    result = simulated(tmp_path, cabinet("a"), facing)
    assert {(f.rule, f.severity, f.where) for f in result.findings} == {("together", "warning", "a_hinge")}
    assert [[blocker.name for blocker in joint.blocked_by] for joint in result.joints] == [["b_hinge"], ["a_hinge"]]
    assert result.together_penetration_m > 0.01
    assert min(joint.travel_reached for joint in result.joints) >= 0.98


def test_openable_units_have_a_free_cavity(tmp_path: Path) -> None:
    result = simulate(write_folder(kitchen(), tmp_path / "b") / "scene.xml")
    assert all(joint.cavity_open is not None and joint.cavity_open > 0.9 for joint in result.joints)


def test_a_recessed_back_panel_does_not_fill_the_cavity(tmp_path: Path) -> None:
    """A shallow wall cabinet whose back is 5 cm in front of its sides' rear edges."""
    item = cabinet("c")
    shallow = [
        replace(box, link_from_box=Rigid3(np.eye(3), box.link_from_box.translation - [0.0, 0.05 * (box.name == "back"), 0.0]))
        for box in item.links[0].boxes
    ]
    (joint,) = simulated(tmp_path, replace(item, links=(replace(item.links[0], boxes=tuple(shallow)), *item.links[1:]))).joints
    assert joint.cavity_open == 1.0


def test_a_flap_opens_upwards_against_its_weight(tmp_path: Path) -> None:
    """5 kg, 0.72 m high: 17.7 N m at the hinge, 24.5 N at its lower edge."""
    item = cabinet("f")
    door, size = item.links[1], item.dimensions_m
    top = np.array([0.0, -size[1] / 2, size[2] / 2])
    shift = door.object_from_link.translation - top
    boxes = tuple(replace(box, link_from_box=Rigid3(np.eye(3), box.link_from_box.translation + shift)) for box in door.boxes)
    inertia = replace(door.inertial, mass_kg=5.0, com_link=door.inertial.com_link + shift)
    door = replace(door, object_from_link=Rigid3(np.eye(3), top), boxes=boxes, inertial=inertia, visual=None)
    joint = replace(item.joints[0], origin_object=top, axis_object=np.array([-1.0, 0.0, 0.0]))
    result = simulated(tmp_path, replace(item, links=(item.links[0], door), joints=(joint,)))
    assert result.joints[0].travel_reached >= 0.98


def test_the_cavity_check_of_a_door_ignores_space_behind_its_neighbour(tmp_path: Path) -> None:
    """A block behind the right door of a pair: the left door's cavity stays free, the right door's does not."""
    item = double_door("d")
    filling = Box(
        name="filling",
        role="inner",
        size_m=np.array([0.4, 0.45, 0.6]),
        link_from_box=Rigid3(np.eye(3), np.array([0.22, 0.03, 0.0])),
    )
    base = replace(item.links[0], boxes=(*item.links[0].boxes, filling))
    left, right = simulated(tmp_path, replace(item, links=(base, *item.links[1:]))).joints
    assert left.cavity_open > 0.9
    assert right.cavity_open < 0.2


def test_a_door_in_front_of_a_solid_block_is_a_finding(tmp_path: Path) -> None:
    item = cabinet("c")
    size = item.dimensions_m - np.array([0.05, 0.05, 0.05])
    filling = Box(name="filling", role="inner", size_m=size, link_from_box=Rigid3(np.eye(3), np.array([0.0, 0.03, 0.0])))
    base = replace(item.links[0], boxes=(*item.links[0].boxes, filling))
    result = simulated(tmp_path, replace(item, links=(base, *item.links[1:])))
    assert "cavity" in {f.rule for f in result.findings}
    assert result.joints[0].cavity_open < 0.1


def test_a_joint_whose_test_fails_is_reported_and_others_are_tested(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = simulation.examine_joint

    def fails(strict: Any, solid: Any, name: str) -> Any:
        if name == "cabinet_1_hinge":
            raise ZeroDivisionError("range of nothing")
        return real(strict, solid, name)

    monkeypatch.setattr(simulation, "examine_joint", fails)
    monkeypatch.setattr(simulation, "leave_alone", lambda _: 1 // 0)
    result = simulated(tmp_path, cabinet("cabinet_1", x=0.0), drawer("drawer_1", x=1.5))
    assert {(f.rule, f.where, f.severity) for f in result.findings} == {
        ("untested", "cabinet_1_hinge", "error"),
        ("untested", "left alone", "error"),
    }
    (tested,) = result.joints
    assert tested.joint == "drawer_1_slide"
    assert tested.travel_reached >= 0.98
