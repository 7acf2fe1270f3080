"""Objects as separate assets: each is complete, with textures, wherever it is placed."""

import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yourdfpy

from r2c2r_core.export.lint import lint
from r2c2r_core.export.reading import read_urdf
from r2c2r_core.export.writers.ros import package_name
from tests.core.export.writers.test_glb import document_of

OBJECTS = ("cabinet_1", "drawer_1", "double_1", "counter_1", "bottle_1")


@pytest.fixture
def moved_away(good_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The bundle's folder, with the working directory elsewhere."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    return good_folder


def test_every_object_has_assets_in_four_formats(good_folder: Path) -> None:
    found = {p.relative_to(good_folder).as_posix() for p in (good_folder / "assets").glob("*/*") if p.is_file()}
    assert found == {f"assets/{name}/{name}{suffix}" for name in OBJECTS for suffix in (".urdf", ".xml", ".usda", ".glb")}


@pytest.mark.parametrize("name", OBJECTS)
def test_an_assets_folder_is_complete_without_the_bundle(good_folder: Path, tmp_path: Path, name: str) -> None:
    from pxr import UsdUtils

    alone = tmp_path / name
    shutil.copytree(good_folder / "assets" / name, alone)
    mujoco.MjModel.from_xml_path(str(alone / f"{name}.xml"))
    yourdfpy.URDF.load(str(alone / f"{name}.urdf"), load_meshes=True)
    layers, textures, unresolved = UsdUtils.ComputeAllDependencies(str(alone / f"{name}.usda"))
    assert not unresolved
    assert all(Path(path).is_relative_to(alone) for path in [layers[0].realPath, *textures])
    images = document_of(alone / f"{name}.glb")[0].get("images", [])
    assert all((alone / image["uri"]).is_file() for image in images)
    assert images or name not in ("cabinet_1", "bottle_1")  # those with a texture


@pytest.mark.parametrize("name", OBJECTS)
def test_a_mujoco_asset_rests_on_its_origin_without_room_elements(moved_away: Path, name: str) -> None:
    model = mujoco.MjModel.from_xml_path(str(moved_away / f"assets/{name}/{name}.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert (model.nlight, model.ncam) == (0, 0)
    lowest = min(_lowest(model, data, geom) for geom in range(model.ngeom) if model.geom_contype[geom])
    assert lowest == pytest.approx(0.0, abs=1e-6)
    assert not any(model.geom(g).name == "floor" for g in range(model.ngeom))


def _lowest(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    centre, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
    corners = centre + half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return float((corners @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])[:, 2].min())


def test_attaching_all_assets_reproduces_the_scene(moved_away: Path) -> None:
    whole = mujoco.MjModel.from_xml_path(str(moved_away / "scene.xml"))
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(moved_away / "scene.usda"))
    spec = mujoco.MjSpec()
    for name in OBJECTS:
        pose = np.array(UsdGeom.Xformable(stage.GetPrimAtPath(f"/Scene/{name}")).GetLocalTransformation()).T
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, pose[:3, :3].ravel())
        child = mujoco.MjSpec.from_file(str(moved_away / f"assets/{name}/{name}.xml"))
        spec.worldbody.add_frame(pos=pose[:3, 3], quat=quat).attach_body(child.worldbody.first_body(), f"{name}_", "")
    model = spec.compile()
    data, other = mujoco.MjData(model), mujoco.MjData(whole)
    mujoco.mj_forward(model, data)
    mujoco.mj_forward(whole, other)
    assert (model.nbody, model.njnt, model.ngeom) == (whole.nbody, whole.njnt, whole.ngeom - 1)  # the floor
    for number in range(1, whole.nbody):
        name = whole.body(number).name
        np.testing.assert_allclose(data.body(name).xpos, other.body(name).xpos, atol=1e-6)
        assert model.body(name).mass == pytest.approx(whole.body(name).mass)


def test_a_referenced_usd_asset_resolves_textures_without_physics_scene(moved_away: Path, tmp_path: Path) -> None:
    from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

    far = tmp_path / "far" / "away"
    far.mkdir(parents=True)
    layer = Sdf.Layer.CreateNew(str(far / "other.usda"))
    world = Sdf.CreatePrimInLayer(layer, "/World")
    world.specifier, world.typeName = Sdf.SpecifierDef, "Xform"
    for number in range(2):
        prim = Sdf.CreatePrimInLayer(layer, f"/World/cabinet_{number}")
        prim.specifier = Sdf.SpecifierDef
        prim.referenceList.prependedItems.append(Sdf.Reference("../../good/assets/cabinet_1/cabinet_1.usda"))
    layer.Save()
    stage = Usd.Stage.Open(str(far / "other.usda"))
    UsdGeom.Xformable(stage.GetPrimAtPath("/World/cabinet_1")).AddTranslateOp().Set((5.0, 0.0, 0.0))
    prims = list(stage.Traverse())
    assert not any(prim.IsA(UsdPhysics.Scene) for prim in prims)
    assert sum(prim.HasAPI(UsdPhysics.ArticulationRootAPI) for prim in prims) == 2
    pictures = [UsdShade.Shader(p).GetInput("file") for p in prims if p.GetName() == "picture"]
    assert len(pictures) == 2
    for picture in pictures:
        assert Path(picture.Get().resolvedPath).is_file()
    cache = UsdGeom.XformCache()
    for number in range(2):  # its base is fixed where the asset is placed, not where it was filmed
        joint = UsdPhysics.FixedJoint(stage.GetPrimAtPath(f"/World/cabinet_{number}/joints/cabinet_1_base_to_world"))
        holder = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(joint.GetBody0Rel().GetTargets()[0]))
        base = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(joint.GetBody1Rel().GetTargets()[0]))
        np.testing.assert_allclose(holder.Transform(joint.GetLocalPos0Attr().Get()), base.ExtractTranslation(), atol=1e-6)


def test_the_usdz_contains_the_whole_scene_with_textures(good_folder: Path, tmp_path: Path) -> None:
    from pxr import Usd, UsdShade, UsdUtils

    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(good_folder / "scene.usdz", alone)
    stage = Usd.Stage.Open(str(alone / "scene.usdz"))
    layered = Usd.Stage.Open(str(good_folder / "scene.usda"))
    assert [prim.GetPath() for prim in layered.Traverse()] == [prim.GetPath() for prim in stage.Traverse()]
    _, _, unresolved = UsdUtils.ComputeAllDependencies(str(alone / "scene.usdz"))
    assert not unresolved
    shown = [UsdShade.Shader(p).GetInput("file").Get().resolvedPath for p in stage.Traverse() if p.GetName() == "picture"]
    assert shown
    assert all(path.startswith(str(alone / "scene.usdz")) for path in shown)


@pytest.mark.parametrize("name", OBJECTS)
def test_a_urdf_asset_loads_standalone_with_the_scenes_joint_limits(moved_away: Path, name: str) -> None:
    path = moved_away / f"assets/{name}/{name}.urdf"
    robot = yourdfpy.URDF.load(str(path), load_meshes=True)
    assert len(robot.scene.geometry) == sum(len(link.visuals) for link in robot.robot.links)
    assert robot.base_link == ("bottle_1_body" if name == "bottle_1" else "world")  # a free-standing object can fall
    scene = {joint.name: joint.limit for joint in read_urdf(moved_away / "scene.urdf").joints}
    assert all(joint.limit == scene[joint.name] for joint in read_urdf(path).joints if joint.type != "fixed")


def test_pybullet_holds_an_asset_still_without_a_warning(moved_away: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pybullet = pytest.importorskip("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81)
    unit = pybullet.loadURDF(str(moved_away / "assets/drawer_1/drawer_1.urdf"), [1, 2, 3])
    for _ in range(10):
        pybullet.stepSimulation()
    place = pybullet.getBasePositionAndOrientation(unit)[0]
    pybullet.disconnect(client)
    said = capfd.readouterr()
    assert place == (1, 2, 3)
    assert "Warning" not in said.out + said.err


def test_a_glb_asset_references_existing_textures(good_folder: Path) -> None:
    document, binary = document_of(good_folder / "assets/cabinet_1/cabinet_1.glb")
    (image,) = document["images"]
    assert (good_folder / "assets/cabinet_1" / image["uri"]).is_file()
    assert document["buffers"][0]["byteLength"] <= len(binary)


def test_the_srdf_disables_collisions_of_adjacent_links(good_folder: Path) -> None:
    pairs = {(e.get("link1"), e.get("link2")) for e in ET.parse(good_folder / "scene.srdf").getroot()}
    assert ("cabinet_1_base", "cabinet_1_door") in pairs
    assert len(pairs) == 4


def test_the_ros_package_resolves_its_meshes_and_has_a_handle_link(good_folder: Path) -> None:
    package = ET.parse(good_folder / "package.xml").findtext("name")
    robot = ET.parse(good_folder / "ros/scene.urdf").getroot()
    for mesh in robot.iter("mesh"):
        start, _, path = mesh.attrib["filename"].partition(f"package://{package}/")
        assert start == ""
        assert (good_folder / path).is_file()
    assert "cabinet_1_door_handle" in {link.get("name") for link in robot.findall("link")}
    assert "assets ros" in (good_folder / "CMakeLists.txt").read_text()


@pytest.mark.parametrize(
    ("name", "expected"), [("My Kitchen__2", "my_kitchen_2"), ("7", "scene_7"), ("", "scene"), ("a", "scene_a")]
)
def test_package_names_follow_the_ros_naming_rules(name: str, expected: str) -> None:
    assert package_name(name) == expected


def test_the_sdf_has_a_model_per_object_and_existing_meshes(good_folder: Path) -> None:
    world = ET.parse(good_folder / "scene.sdf").getroot().find("world")
    assert world is not None
    assert {model.get("name") for model in world.findall("model")} == {"floor", *OBJECTS}
    assert all((good_folder / str(uri.text)).is_file() for uri in world.iter("uri"))
    assert not list(world.iter("plane"))  # Drake crashes if one comes before meshes
    bottle = next(model for model in world.findall("model") if model.get("name") == "bottle_1")
    assert bottle.find("joint") is None  # it falls when pushed


def test_every_sdf_joint_has_zero_spring_reference_and_stiffness(good_folder: Path) -> None:
    dynamics = list(ET.parse(good_folder / "scene.sdf").getroot().iter("dynamics"))
    assert dynamics
    for joint in dynamics:
        assert [joint.findtext(key) for key in ("spring_reference", "spring_stiffness")] == ["0", "0"]


@pytest.mark.parametrize(
    "name", ["assets/cabinet_1/cabinet_1.usda", "assets/cabinet_1/cabinet_1.xml", "assets/cabinet_1/cabinet_1.urdf"]
)
def test_an_asset_with_a_path_outside_the_bundle_fails_the_linter(good_folder: Path, name: str) -> None:
    path = good_folder / name
    path.write_text(path.read_text().replace("meshes/", "../../../meshes/"))
    assert {f.rule for f in lint(good_folder)} == {"asset-path"}


def test_the_linter_reports_missing_unreadable_and_differing_assets(good_folder: Path) -> None:
    path = good_folder / "assets/drawer_1/drawer_1.urdf"
    path.write_text(path.read_text().replace('upper="0.42"', 'upper="0.43"'))
    (good_folder / "assets/cabinet_1/cabinet_1.glb").write_bytes(b"glTF")
    other = good_folder / "assets/bottle_1/bottle_1.xml"
    other.write_text(other.read_text().replace("_col_0.obj", "_col_7.obj"))
    assert {(f.rule, f.where) for f in lint(good_folder)} == {
        ("asset-differs", "assets/drawer_1/drawer_1.urdf"),
        ("asset-unreadable", "assets/cabinet_1/cabinet_1.glb"),
        ("asset-missing", "assets/bottle_1/bottle_1.xml"),
    }
