"""scene.usda as the USD library reads it, compared with the plan it was written from."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdShade

from r2c2r_core.export.plan import Plan, plan_bundle
from r2c2r_core.export.preview import poses_at
from r2c2r_core.geometry.transforms import Rigid3
from tests.core.export.kitchen import kitchen


@pytest.fixture
def stage(good_folder: Path) -> Usd.Stage:
    return Usd.Stage.Open(str(good_folder / "scene.usda"))


@pytest.fixture
def plan() -> Plan:
    return plan_bundle(kitchen())


def named(stage: Usd.Stage, name: str) -> Usd.Prim:
    (found,) = [prim for prim in stage.Traverse() if prim.GetName() == name]
    return found


def frame(position: Any, rotation: Any) -> Rigid3:
    w, (x, y, z) = rotation.GetReal(), rotation.GetImaginary()
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return Rigid3(turn, np.array(position, dtype=np.float64))


def along_x(kind: str, value: float) -> Rigid3:
    """Transform of a joint along or about USD's X axis, at a position in metres or degrees."""
    if kind == "PhysicsPrismaticJoint":
        return Rigid3(np.eye(3), np.array([value, 0.0, 0.0]))
    c, s = np.cos(np.radians(value)), np.sin(np.radians(value))
    return Rigid3(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.zeros(3))


@pytest.mark.parametrize("fraction", [0.0, 0.5, 1.0])
def test_usd_joints_move_bodies_as_planned(stage: Usd.Stage, plan: Plan, fraction: float) -> None:
    poses = poses_at(plan, fraction)
    for body in plan.bodies:
        if body.joint is None:
            continue
        prim = named(stage, body.joint_name)
        joint = UsdPhysics.Joint(prim)
        assert [target.name for target in joint.GetBody0Rel().GetTargets()] == [body.parent]
        assert [target.name for target in joint.GetBody1Rel().GetTargets()] == [body.name]
        assert prim.GetAttribute("physics:axis").Get() == "X"
        at = fraction * prim.GetAttribute("physics:upperLimit").Get()
        first = frame(joint.GetLocalPos0Attr().Get(), joint.GetLocalRot0Attr().Get())
        second = frame(joint.GetLocalPos1Attr().Get(), joint.GetLocalRot1Attr().Get())
        found = poses[body.parent] @ first @ along_x(prim.GetTypeName(), at) @ second.inverse
        np.testing.assert_allclose(found.matrix, poses[body.name].matrix, atol=1e-5)


def test_usd_bodies_have_the_planned_pose_mass_and_inertia(stage: Usd.Stage, plan: Plan) -> None:
    cache = UsdGeom.XformCache()
    for body in plan.bodies:
        prim = named(stage, body.name)
        np.testing.assert_allclose(np.array(cache.GetLocalToWorldTransform(prim)).T, body.world_from_body.matrix, atol=1e-6)
        mass = UsdPhysics.MassAPI(prim)
        turn = frame((0, 0, 0), mass.GetPrincipalAxesAttr().Get()).rotation
        inertia = turn @ np.diag(np.array(mass.GetDiagonalInertiaAttr().Get(), dtype=np.float64)) @ turn.T
        inertial = body.link.inertial
        np.testing.assert_allclose(inertia, inertial.inertia, rtol=1e-4, atol=1e-5 * np.trace(inertial.inertia))
        assert mass.GetMassAttr().Get() == pytest.approx(inertial.mass_kg)
        np.testing.assert_allclose(mass.GetCenterOfMassAttr().Get(), inertial.com_link, atol=1e-6)


def test_movable_objects_are_dynamic_and_counters_are_static(stage: Usd.Stage) -> None:
    dynamic = {prim.GetName() for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)}
    assert {"drawer_1_base", "drawer_1_drawer", "bottle_1_body"} <= dynamic
    assert not {name for name in dynamic if name.startswith("counter_1")}
    roots = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.ArticulationRootAPI)]
    assert {prim.GetName() for prim in roots} == {"cabinet_1", "drawer_1", "double_1"}
    assert not any(prim.HasAPI(UsdPhysics.RigidBodyAPI) for prim in roots)
    fixed = [UsdPhysics.Joint(p) for p in stage.Traverse() if p.IsA(UsdPhysics.FixedJoint)]
    assert {j.GetBody1Rel().GetTargets()[0].name for j in fixed} == {"cabinet_1_base", "drawer_1_base", "double_1_base"}


def test_drives_friction_and_velocity_limits_use_usd_units(stage: Usd.Stage, plan: Plan) -> None:
    for body in plan.bodies:
        if body.joint is None:
            continue
        prim = named(stage, body.joint_name)
        hinge = body.joint.type == "revolute"
        instance, degrees = ("angular", 180 / np.pi) if hinge else ("linear", 1.0)
        drive = UsdPhysics.DriveAPI(prim, instance)
        assert drive.GetDampingAttr().Get() * degrees == pytest.approx(body.joint.damping)
        assert drive.GetMaxForceAttr().Get() == pytest.approx(body.joint.effort)
        assert f"PhysxJointAxisAPI:{instance}" in prim.GetPrimTypeInfo().GetAppliedAPISchemas() + [
            name for name in prim.GetMetadata("apiSchemas").GetAddedOrExplicitItems()
        ]
        say = prim.GetAttribute(f"physxJointAxis:{instance}:staticFrictionEffort")
        assert say.Get() == pytest.approx(body.joint.friction)
        for prefix in (f"physxJointAxis:{instance}", "physxJoint"):  # readers know one or the other
            limit = prim.GetAttribute(f"{prefix}:maxJointVelocity")
            assert limit.Get() == pytest.approx(body.joint.velocity * degrees)


def test_newton_gets_the_joint_parameters_that_mujoco_has_in_the_mjcf(stage: Usd.Stage, good_folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    joints = [model.joint(number) for number in range(model.njnt) if model.jnt_type[number] != mujoco.mjtJoint.mjJNT_FREE]
    assert joints
    for joint in joints:
        prim = named(stage, joint.name)
        assert prim.GetAttribute("mjc:frictionloss").Get() == pytest.approx(joint.frictionloss[0])
        assert prim.GetAttribute("mjc:armature").Get() == pytest.approx(joint.armature[0])
        assert list(prim.GetAttribute("mjc:solreflimit").Get()) == pytest.approx(list(model.jnt_solref[joint.id]))


def test_visuals_are_textured_and_colliders_are_convex_guides(stage: Usd.Stage, good_folder: Path) -> None:
    door = stage.GetPrimAtPath("/Scene/cabinet_1/cabinet_1_door/visual")
    material, _ = UsdShade.MaterialBindingAPI(door).ComputeBoundMaterial()
    picture = UsdShade.Shader(material.GetPrim().GetChild("picture")).GetInput("file").Get()
    assert Path(picture.resolvedPath).is_relative_to(good_folder)
    assert not door.HasAPI(UsdPhysics.CollisionAPI)
    for prim in stage.Traverse():
        if prim.HasAPI(UsdPhysics.CollisionAPI) and prim.GetName() != "floor":
            assert UsdGeom.Imageable(prim).GetPurposeAttr().Get() == "guide"
            if prim.IsA(UsdGeom.Mesh):
                assert UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get() == "convexHull"


def test_equal_plans_give_identical_usd_bytes(good_folder: Path, tmp_path: Path) -> None:
    from tests.core.export.conftest import write_folder

    other = write_folder(kitchen(), tmp_path / "other")
    assert (other / "scene.usda").read_bytes() == (good_folder / "scene.usda").read_bytes()


def test_the_default_prim_holds_only_the_objects_and_the_rest_is_beside_it(stage: Usd.Stage) -> None:
    kinds = {prim.GetName(): prim.GetTypeName() for prim in stage.GetPseudoRoot().GetChildren()}
    assert kinds == {
        "Scene": "Xform",
        "physics": "PhysicsScene",
        "floor": "Plane",
        "ambient": "DomeLight",
        "sun": "DistantLight",
        "front": "Camera",
    }
    assert stage.GetDefaultPrim().GetName() == "Scene"
    below = {prim.GetTypeName() for prim in Usd.PrimRange(stage.GetDefaultPrim())}
    assert not below & {"PhysicsScene", "Plane", "DomeLight", "DistantLight", "Camera"}


def test_light_and_camera_are_those_of_the_mjcf(stage: Usd.Stage, good_folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    cache = UsdGeom.XformCache()
    sun, camera = (np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(path))).T for path in ("/sun", "/front"))
    np.testing.assert_allclose(sun[:3, :3] @ [0, 0, -1], model.light("sun").dir, atol=1e-6)
    np.testing.assert_allclose(camera[:3, 3], data.cam("front").xpos, atol=1e-6)
    np.testing.assert_allclose(camera[:3, :3], data.cam("front").xmat.reshape(3, 3), atol=1e-6)
    seen = UsdGeom.Camera(stage.GetPrimAtPath("/front")).GetCamera(Usd.TimeCode.Default())
    assert seen.GetFieldOfView(Gf.Camera.FOVVertical) == pytest.approx(model.cam("front").fovy[0])
