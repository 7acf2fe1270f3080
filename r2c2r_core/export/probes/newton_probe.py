"""Load scene.usda in Newton, on the CPU, and write out its values: `python newton_probe.py scene.usda answer.json`.

Runs in Newton's own environment, so it imports nothing from r2c2r but its neighbouring script. Every joint is released along
its travel in Newton's MuJoCo solver. Newton reads friction and armature from its own schema, damping and effort from the
drive; it has no body for fixed parts.
"""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from releasing import STEP_S, STEPS, release_everywhere  # type: ignore[import-not-found]  # the file beside this one

_KINDS = {0: "prismatic", 1: "revolute"}  # newton.JointType
_COLLIDES = 2  # newton.ShapeFlags.COLLIDE_SHAPES


def read_back(scene: Path) -> dict[str, Any]:
    """Joints and bodies as stored by Newton, joints closed."""
    import newton  # type: ignore[import-not-found]  # lives in an environment of its own
    import warp  # type: ignore[import-not-found]
    from newton.usd import SchemaResolverNewton, SchemaResolverPhysx  # type: ignore[import-not-found]

    with warp.ScopedDevice("cpu"):
        builder = newton.ModelBuilder()
        newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
        builder.add_usd(str(scene), schema_resolvers=[SchemaResolverNewton(), SchemaResolverPhysx()])
        model = builder.finalize()
        closed = model.state()
        newton.eval_fk(model, model.joint_q, model.joint_qd, closed)
        names = [str(label).rsplit("/", 1)[-1] for label in model.body_label]
        moving = [joint for joint, kind in enumerate(model.joint_type.numpy()) if int(kind) in _KINDS]
        return {
            "version": f"Newton {version('newton')}",
            "joints": {str(model.joint_label[j]).rsplit("/", 1)[-1]: _joint(model, closed, j) for j in moving},
            "bodies": {name: _body(model, closed, body) for body, name in enumerate(names)},
            "in_world": _fixed(scene),
            "problem": _swept(newton, model, moving),
        }


def _fixed(scene: Path) -> list[str]:
    """Names of prims with a mass but without a rigid body, which Newton merges into the world."""
    from pxr import Usd, UsdPhysics

    stage = Usd.Stage.Open(str(scene))  # prims end with their stage
    return [p.GetName() for p in stage.Traverse() if p.HasAPI(UsdPhysics.MassAPI) and not p.HasAPI(UsdPhysics.RigidBodyAPI)]


def _joint(model: Any, closed: Any, joint: int) -> dict[str, Any]:
    dof = int(model.joint_qd_start.numpy()[joint])
    child = closed.body_q.numpy()[model.joint_child.numpy()[joint]]
    in_child = model.joint_X_c.numpy()[joint]
    turn = _matrix(child[3:]) @ _matrix(in_child[3:])
    return {
        "type": _KINDS[int(model.joint_type.numpy()[joint])],
        "axis_world": (turn @ model.joint_axis.numpy()[dof]).tolist(),
        "origin_world": (child[:3] + _matrix(child[3:]) @ in_child[:3]).tolist(),
        "lower": float(model.joint_limit_lower.numpy()[dof]),
        "upper": float(model.joint_limit_upper.numpy()[dof]),
        "damping": float(model.joint_target_kd.numpy()[dof]),
        "friction": float(model.joint_friction.numpy()[dof]),
        "effort": float(model.joint_effort_limit.numpy()[dof]),
    }


def _body(model: Any, closed: Any, body: int) -> dict[str, Any]:
    pose = closed.body_q.numpy()[body]
    turn = _matrix(pose[3:])
    own = (model.shape_body.numpy() == body) & ((model.shape_flags.numpy() & _COLLIDES) > 0)
    return {
        "mass_kg": float(model.body_mass.numpy()[body]),
        "com_world": (pose[:3] + turn @ model.body_com.numpy()[body]).tolist(),
        "inertia_world": (turn @ model.body_inertia.numpy()[body] @ turn.T).tolist(),
        "rotation_world": turn.tolist(),
        "origin_world": pose[:3].tolist(),
        "colliders": int(own.sum()),
    }


def _swept(newton: Any, model: Any, moving: list[int]) -> str:
    """Description of the first joint that fails the release sweep; empty where none does."""
    solver, control, closed = newton.solvers.SolverMuJoCo(model), model.control(), model.joint_q.numpy()
    number = {str(model.joint_label[joint]).rsplit("/", 1)[-1]: joint for joint in moving}
    starts, dofs = model.joint_q_start.numpy(), model.joint_qd_start.numpy()
    lower, upper = model.joint_limit_lower.numpy(), model.joint_limit_upper.numpy()

    def released(name: str, position: float) -> float:
        now, after, q = model.state(), model.state(), closed.copy()
        q[starts[number[name]]] = position
        now.joint_q.assign(q)
        newton.eval_fk(model, now.joint_q, now.joint_qd, now)
        for _ in range(STEPS):
            now.clear_forces()
            solver.step(now, after, control, None, STEP_S)
            now, after = after, now
        q = now.joint_q.numpy()
        return float(q[starts[number[name]]]) if np.isfinite(q).all() else np.nan

    limits = {name: (float(lower[dofs[joint]]), float(upper[dofs[joint]])) for name, joint in number.items()}
    return str(release_everywhere(limits, released))


def _matrix(quat_xyzw: np.ndarray) -> np.ndarray:
    x, y, z, w = np.asarray(quat_xyzw, dtype=np.float64) / np.linalg.norm(quat_xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(Path(sys.argv[1]))))
