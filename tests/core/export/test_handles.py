"""Handles as objects: position, opening direction, and clearance for a gripper."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from r2c2r_core.export.handles import out_of_reach, with_handles
from r2c2r_core.export.lint import lint
from r2c2r_core.export.plan import Plan, plan_bundle
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.handle import Handle
from r2c2r_core.model.scene import ArticulatedScene, Box, SceneObject
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import cabinet, drawer, kitchen


def planned(*objects: SceneObject) -> Plan:
    return with_handles(plan_bundle(ArticulatedScene(name="t", objects=objects, layout_moves_m={}, warnings=())))


def only(plan: Plan) -> Handle:
    (handle,) = plan.handles
    return handle


def without_handles(item: SceneObject) -> SceneObject:
    return replace(item, links=tuple(replace(x, boxes=tuple(b for b in x.boxes if b.role != "handle")) for x in item.links))


def with_handle_size(item: SceneObject, size: list[float]) -> SceneObject:
    def resized(box: Box) -> Box:
        return replace(box, size_m=np.array(size)) if box.role == "handle" else box

    return replace(item, links=tuple(replace(x, boxes=tuple(map(resized, x.boxes))) for x in item.links))


def test_a_drawer_handle_frame_matches_a_grasping_gripper() -> None:
    handle = only(planned(drawer("drawer_1")))
    np.testing.assert_allclose(handle.world_from_handle.translation, [0, -0.28 - 0.015, 0.52 + 0.15 + 0.08], atol=1e-9)
    np.testing.assert_allclose(handle.world_from_handle.rotation, [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-9)
    np.testing.assert_allclose(handle.opening_world, [0, -1, 0], atol=1e-9)
    np.testing.assert_allclose(handle.size_m, [0.18, 0.012, 0.03], atol=1e-9)
    assert handle.protrusion_m == pytest.approx(0.03)
    assert handle.kind == "knob"  # solid back to the front


def test_the_manifest_says_where_a_handle_comes_from(tmp_path: Path) -> None:
    item, said = drawer("drawer_1"), {"place": "measured", "protrusion": "default"}
    known = [replace(b, sources=said, confidence=0.8) if b.role == "handle" else b for b in item.links[1].boxes]
    item = replace(item, links=(item.links[0], replace(item.links[1], boxes=tuple(known))))
    scene = ArticulatedScene(name="t", objects=(item, without_handles(cabinet("a", x=2.0))), layout_moves_m={}, warnings=())
    manifest = json.loads((write_folder(scene, tmp_path / "b") / "manifest.json").read_text())
    bar, push = (entry["joint"]["handles"][0] for entry in manifest["objects"])
    assert bar["source"] == {"place": "measured", "protrusion": "default", "thickness": "default"}
    assert bar["confidence"] == 0.8
    assert (set(push["source"].values()), push["confidence"]) == ({"default"}, None)


def test_a_handle_rotates_with_its_cabinet_and_opens_about_the_hinge() -> None:
    straight, turned = only(planned(cabinet("a"))), only(planned(cabinet("a", yaw=0.7)))
    about_z = straight.world_from_handle.rotation.T @ turned.world_from_handle.rotation
    assert np.arccos((np.trace(about_z) - 1) / 2) == pytest.approx(0.7)
    body = next(b for b in planned(cabinet("a", yaw=0.7)).bodies if b.joint is not None)
    arm = turned.world_from_handle.translation - body.world_from_body.translation
    axis = body.world_from_body.turn(body.axis_body)
    assert float(turned.opening_world @ arm) == pytest.approx(0.0, abs=0.03)  # the handle is in front of the hinge's plane
    assert float(turned.opening_world @ np.cross(axis, arm)) > 0


def test_finger_clearance_beside_a_handle_ends_at_the_nearest_obstacle() -> None:
    free = only(planned(drawer("drawer_1")))
    assert free.room.beside_m == (0.3, 0.3)
    board = Box(
        name="board",
        role="carcass",
        size_m=np.array([0.6, 0.1, 0.02]),
        link_from_box=Rigid3(np.eye(3), np.array([0, -0.3, 0.11])),
    )
    item = drawer("drawer_1")
    base = replace(item.links[0], boxes=(*item.links[0].boxes, board))
    near = only(planned(replace(item, links=(base, item.links[1]))))
    # y points down along the front, so the board 14 mm above the grip's face is on the first side
    assert near.room.beside_m == (pytest.approx(0.014, abs=5e-4), 0.3)
    assert near.room.depth_m == (pytest.approx(0.03, abs=5e-4), pytest.approx(0.03, abs=5e-4))


def test_a_front_without_a_handle_gets_a_push_point_at_its_free_edge() -> None:
    handle = only(planned(without_handles(cabinet("a"))))
    assert (handle.kind, handle.name) == ("push", "a_door_push")
    width = 0.6 - 0.003
    np.testing.assert_allclose(handle.world_from_handle.translation[:2], [width / 2 - 0.03, -0.28], atol=1e-9)
    middle = only(planned(without_handles(drawer("d"))))
    np.testing.assert_allclose(middle.world_from_handle.translation[:2], [0, -0.28], atol=1e-9)
    assert out_of_reach(handle.kind, handle.grasp_width_m, handle.room) is None


def test_every_format_places_handles_as_in_the_manifest(good_folder: Path) -> None:
    from pxr import Usd, UsdGeom

    manifest = json.loads((good_folder / "manifest.json").read_text())
    handles = [h for item in manifest["objects"] for joint in item["joints"] for h in joint["handles"]]
    assert [h["link"] for h in handles] == ["cabinet_1_door", "drawer_1_drawer", "double_1_left", "double_1_right"]
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    stage = Usd.Stage.Open(str(good_folder / "scene.usda"))
    prims = {prim.GetName(): prim for prim in stage.Traverse()}
    listed = {e.get("name"): e for e in ET.parse(good_folder / "scene.urdf").getroot().findall("r2c2r/handle")}
    for handle in handles:
        axes = np.column_stack([handle["axis"], handle["closing"], handle["approach"]])
        site = data.site(handle["name"])
        np.testing.assert_allclose(site.xpos, handle["centre"], atol=1e-6)
        np.testing.assert_allclose(site.xmat.reshape(3, 3), axes, atol=1e-6)
        if handle["kind"] != "push":
            np.testing.assert_allclose(2 * model.site(handle["name"]).size, handle["size_m"], atol=1e-6)
        world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prims[handle["name"]])).T
        np.testing.assert_allclose(world[:3], np.column_stack([axes, handle["centre"]]), atol=1e-6)
        assert listed[handle["name"]].get("link") == handle["link"]


def test_the_opening_direction_matches_the_handles_motion_in_mujoco(good_folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    for handle in with_handles(plan_bundle(kitchen())).handles:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        closed = data.site(handle.name).xpos.copy()
        data.qpos[model.joint(handle.joint).qposadr[0]] = 1e-4
        mujoco.mj_forward(model, data)
        moved = data.site(handle.name).xpos - closed
        np.testing.assert_allclose(moved / np.linalg.norm(moved), handle.opening_world, atol=1e-3)  # of a chord of 0.1 mrad


def test_a_handle_too_thick_for_the_gripper_is_reported_as_a_warning(tmp_path: Path) -> None:
    thick = with_handle_size(drawer("drawer_1"), [0.18, 0.03, 0.1])
    scene = ArticulatedScene(name="t", objects=(thick,), layout_moves_m={}, warnings=())
    found = [f for f in lint(write_folder(scene, tmp_path / "b")) if f.rule == "handle-reach"]
    assert [f.severity for f in found] == ["warning"]
    assert found[0].message.endswith("it is 100 mm thick, the fingers open 80 mm")


def test_handles_of_the_good_kitchen_are_reachable() -> None:
    for handle in with_handles(plan_bundle(kitchen())).handles:
        assert out_of_reach(handle.kind, handle.grasp_width_m, handle.room) is None
