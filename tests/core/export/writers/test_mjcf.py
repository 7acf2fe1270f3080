from pathlib import Path

import mujoco
import numpy as np
import pytest

from r2c2r_core.export.plan import collider_corners_world, facing, plan_bundle
from r2c2r_core.export.preview import poses_at
from tests.core.export.kitchen import kitchen


@pytest.fixture
def model(good_folder: Path) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))


def test_mjcf_and_urdf_give_the_same_mujoco_bodies_and_joints(good_folder: Path, model: mujoco.MjModel) -> None:
    other = mujoco.MjModel.from_xml_path(str(good_folder / "scene.urdf"))
    names = {model.body(b).name for b in range(1, model.nbody)}
    assert names == {other.body(b).name for b in range(1, other.nbody)}
    for name in names:
        a, b = model.body(name), other.body(name)
        assert a.mass[0] == pytest.approx(b.mass[0], rel=1e-6)
        np.testing.assert_allclose(np.sort(a.inertia), np.sort(b.inertia), rtol=1e-6)
    for j in range(other.njnt):
        a, b = model.joint(other.joint(j).name), other.joint(j)
        assert a.type[0] == b.type[0]
        np.testing.assert_allclose(a.range, b.range, atol=1e-6)
        np.testing.assert_allclose(a.axis, b.axis, atol=1e-6)
        for attribute in ("dof_damping", "dof_frictionloss"):
            there, here = getattr(model, attribute)[a.dofadr[0]], getattr(other, attribute)[b.dofadr[0]]
            assert there == pytest.approx(here)


def test_joints_do_not_creep_under_half_their_dry_friction(model: mujoco.MjModel) -> None:
    """Half the friction force acts on every joint for five seconds, without contacts: motion is below 1 mrad or 1 mm."""
    model.opt.gravity[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    dofs = [model.joint(j).dofadr[0] for j in range(model.njnt) if model.joint(j).type[0] != mujoco.mjtJoint.mjJNT_FREE]
    start = data.qpos.copy()
    data.qfrc_applied[dofs] = 0.5 * model.dof_frictionloss[dofs]
    for _ in range(2500):
        mujoco.mj_step(model, data)
    moved = [abs(data.qpos[model.jnt_qposadr[j]] - start[model.jnt_qposadr[j]]) for j in model.dof_jntid[dofs]]
    assert 0 < max(moved) < 1e-3


@pytest.mark.parametrize("fraction", [0.0, 0.5, 1.0])
def test_mujoco_body_poses_match_the_plan(model: mujoco.MjModel, fraction: float) -> None:
    plan = plan_bundle(kitchen())
    data = mujoco.MjData(model)
    for body in plan.bodies:
        if body.joint is not None:
            data.qpos[model.joint(body.joint_name).qposadr[0]] = fraction * body.joint.upper
    mujoco.mj_kinematics(model, data)
    for name, pose in poses_at(plan, fraction).items():
        if name != "world":
            np.testing.assert_allclose(data.body(name).xpos, pose.translation, atol=1e-6)
            np.testing.assert_allclose(data.body(name).xmat.reshape(3, 3), pose.rotation, atol=1e-6)


def test_visuals_have_no_contacts_and_textures_are_loaded(model: mujoco.MjModel) -> None:
    for g in range(model.ngeom):
        visual = model.geom_group[g] == 2
        assert visual == (model.geom_contype[g] == 0 and model.geom_conaffinity[g] == 0)
    door = model.geom("cabinet_1_door_vis")
    material = int(door.matid[0])
    texture = model.mat_texid[material][int(mujoco.mjtTextureRole.mjTEXROLE_RGB)]
    assert texture >= 0
    assert (model.tex_width[texture], model.tex_height[texture]) == (64, 64)


def test_four_parent_child_pairs_are_excluded_from_contact(model: mujoco.MjModel) -> None:
    assert model.nexclude == 4


def test_the_front_camera_frames_the_kitchen_and_the_light_faces_it(model: mujoco.MjModel) -> None:
    plan = plan_bundle(kitchen())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    eye, axes = data.cam("front").xpos, data.cam("front").xmat.reshape(3, 3)
    seen = (np.concatenate([points for body in plan.bodies for points in collider_corners_world(body)]) - eye) @ axes
    assert (seen[:, 2] < 0).all()  # MuJoCo's cameras look along -z
    slope = np.tan(np.radians(model.cam("front").fovy[0] / 2))
    assert (np.abs(seen[:, 1] / seen[:, 2]) < slope).all()
    assert (np.abs(seen[:, 0] / seen[:, 2]) < slope * 4 / 3).all()
    fronts = facing(plan)
    assert fronts is not None
    np.testing.assert_allclose(fronts, [0.0, -1.0, 0.0], atol=1e-9)
    assert (eye - model.stat.center) @ fronts > 0.5
    assert model.light("sun").dir @ fronts < -0.3


def test_full_hd_rendering_is_allowed_and_the_floor_is_white(model: mujoco.MjModel) -> None:
    assert (model.vis.global_.offwidth, model.vis.global_.offheight) == (1920, 1080)
    np.testing.assert_array_equal(model.geom("floor").rgba, [1.0, 1.0, 1.0, 1.0])
    assert model.geom("floor").friction[0] == model.geom("cabinet_1_door_col_0").friction[0]
