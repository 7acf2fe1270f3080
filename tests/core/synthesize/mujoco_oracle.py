"""MuJoCo as the oracle: whether the scene rests, and every joint opens."""

import mujoco
import numpy as np

from r2c2r_core.model.scene import ArticulatedScene, SceneObject


def _quat(rotation: np.ndarray) -> list[float]:
    out = np.zeros(4)
    mujoco.mju_mat2Quat(out, np.ascontiguousarray(rotation).ravel())
    return list(out)


def compile_scene(scene: ArticulatedScene) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.timestep = 0.002
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for item in scene.objects:
        _add(spec, item)
    return spec.compile()


def _add(spec: mujoco.MjSpec, item: SceneObject) -> None:
    bodies = {}
    for link in item.links:
        joint = next((j for j in item.joints if j.child == link.name), None)
        parent = bodies[joint.parent] if joint else spec.worldbody
        pose = link.object_from_link if joint else item.world_from_object @ link.object_from_link
        body = parent.add_body(name=link.name, pos=list(pose.translation), quat=_quat(pose.rotation))
        bodies[link.name] = body
        inertial = link.inertial
        i = inertial.inertia
        body.mass = inertial.mass_kg
        body.ipos = list(inertial.com_link)
        body.fullinertia = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]
        body.explicitinertial = True
        for box in link.boxes:
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=list(box.size_m / 2),
                pos=list(box.link_from_box.translation),
                quat=_quat(box.link_from_box.rotation),
            )
        for piece in link.pieces:
            mesh = spec.add_mesh(name=f"{link.name}_{piece.name}", uservert=list(piece.vertices_link.ravel()))
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name)
        if joint is not None:
            slide = joint.type == "prismatic"
            body.add_joint(
                name=joint.name,
                type=mujoco.mjtJoint.mjJNT_SLIDE if slide else mujoco.mjtJoint.mjJNT_HINGE,
                pos=[0, 0, 0],
                axis=list(joint.axis_object),
                range=[joint.lower, joint.upper],
                limited=True,
                damping=joint.damping,
                frictionloss=joint.friction,
                armature=0.001,
            )
        elif item.movable:
            body.add_freejoint()


def deepest_contact(model: mujoco.MjModel, positions: dict[str, float] | None = None) -> float:
    """Deepest penetration in metres at the given joint positions; 0 without contact."""
    data = mujoco.MjData(model)
    for name, value in (positions or {}).items():
        data.joint(name).qpos[0] = value
    mujoco.mj_forward(model, data)
    return max((-float(c.dist) for c in data.contact), default=0.0)


def sweep(scene: ArticulatedScene, model: mujoco.MjModel) -> dict[str, float]:
    """Deepest penetration over each joint's sweep of 21 positions, with the others closed."""
    return {
        joint.name: max(deepest_contact(model, {joint.name: float(q)}) for q in np.linspace(joint.lower, joint.upper, 21))
        for item in scene.objects
        for joint in item.joints
    }


def reached(scene: ArticulatedScene, model: mujoco.MjModel, seconds: float = 4.0) -> dict[str, float]:
    """Fraction of each joint's travel reached under 30 N or 10 N m."""
    result = {}
    for item in scene.objects:
        for joint in item.joints:
            data = mujoco.MjData(model)
            dof = model.joint(joint.name).dofadr[0]
            best = 0.0
            for _ in range(int(seconds / model.opt.timestep)):
                data.qfrc_applied[dof] = 30.0 if joint.type == "prismatic" else 10.0
                mujoco.mj_step(model, data)
                best = max(best, float(data.joint(joint.name).qpos[0]))
                if best >= joint.upper:
                    break
            result[joint.name] = best / joint.upper
    return result
