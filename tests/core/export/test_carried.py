"""A jar in a drawer: a free body in simulators, a child of the drawer where bodies cannot be free."""

import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
import yourdfpy
from pxr import Usd, UsdPhysics

from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.preview import poses_at
from r2c2r_core.export.simulate import simulate
from r2c2r_core.model.scene import ArticulatedScene
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import WALL_M, bottle, drawer

FLOOR_Z = 0.52 + WALL_M + 0.02 + 0.005  # upper face of the tray
TRAVEL_M = 0.42


def stocked() -> ArticulatedScene:
    """The jar is listed before the drawer that carries it."""
    jar = replace(bottle("jar", x=0.1, bottom_z=FLOOR_Z + 0.0005, height_m=0.1), carried_by="drawer_1_drawer")
    return ArticulatedScene(name="t", objects=(jar, drawer("drawer_1")), layout_moves_m={}, warnings=())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(stocked(), tmp_path_factory.mktemp("bundle") / "stocked")


def test_a_carried_thing_is_a_child_of_its_drawer_and_moves_with_it() -> None:
    plan = plan_bundle(stocked())
    assert plan.body("jar_body").parent == "drawer_1_drawer"
    closed, opened = (poses_at(plan, share)["jar_body"].translation for share in (0.0, 1.0))
    np.testing.assert_allclose(opened - closed, [0.0, -TRAVEL_M, 0.0], atol=1e-9)
    np.testing.assert_allclose(closed, plan.body("jar_body").world_from_body.translation, atol=1e-9)


def test_urdf_and_gltf_move_it_with_the_drawer(folder: Path) -> None:
    robot = yourdfpy.URDF.load(str(folder / "scene.urdf"), load_meshes=False)
    places = []
    for share in (0.0, TRAVEL_M):
        robot.update_cfg({"drawer_1_slide": share})
        places.append(robot.get_transform("jar_body")[:3, 3])
    np.testing.assert_allclose(places[1] - places[0], [0.0, -TRAVEL_M, 0.0], atol=1e-6)
    graph = trimesh.load(folder / "scene.glb").graph
    assert graph.transforms.parents["jar_body"] == "drawer_1_drawer"


def test_in_mujoco_it_is_free_and_the_drawer_carries_it_by_contact(folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data, jar = mujoco.MjData(model), model.body("jar_body").id
    address = int(model.joint("drawer_1_slide").qposadr[0])
    mujoco.mj_forward(model, data)
    start = data.xpos[jar].copy()
    data.qfrc_applied[int(model.joint("drawer_1_slide").dofadr[0])] = 10.0
    for _ in range(1500):
        mujoco.mj_step(model, data)
    assert data.qpos[address] == pytest.approx(TRAVEL_M, abs=0.005)
    assert start[1] - data.xpos[jar][1] > 0.3
    assert data.xpos[jar][2] == pytest.approx(start[2], abs=0.002)


def test_keyframes_move_it_with_the_drawer(folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    places = []
    for name in ("closed", "open"):
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, model.key(name).id)
        mujoco.mj_forward(model, data)
        places.append(data.xpos[model.body("jar_body").id].copy())
    np.testing.assert_allclose(places[1] - places[0], [0.0, -TRAVEL_M, 0.0], atol=1e-6)


def test_it_does_not_count_as_an_obstacle_of_its_drawer(folder: Path) -> None:
    result = simulate(folder / "scene.xml")
    assert not result.findings
    assert result.joints[0].blocked_by == ()
    assert result.most_drift_m < 1e-3


def test_its_own_asset_is_a_free_body(folder: Path) -> None:
    asset = yourdfpy.URDF.load(str(folder / "assets/jar/jar.urdf"), load_meshes=False)
    assert asset.base_link == "jar_body"
    stage = Usd.Stage.Open(str(folder / "scene.usda"))
    prim = next(prim for prim in stage.Traverse() if prim.GetName() == "jar_body")
    assert prim.HasAPI(UsdPhysics.RigidBodyAPI)
    assert not [each for each in stage.Traverse() if each.IsA(UsdPhysics.Joint) and "jar" in str(each.GetPath())]


def test_the_manifest_names_the_drawer_of_a_thing(folder: Path) -> None:
    entries = {entry["name"]: entry for entry in json.loads((folder / "manifest.json").read_text())["objects"]}
    assert (entries["jar"]["carried_by"], entries["drawer_1"]["carried_by"]) == ("drawer_1_drawer", None)
