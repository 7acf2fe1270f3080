"""Reference one object from a USD stage of your own and open it in Newton: python examples/asset_in_usd.py FOLDER OBJECT STAGE

FOLDER is an unpacked bundle, STAGE is the file to write. Needs Newton (pip install 'newton[sim,importers]').
"""

import importlib.util
import os
import sys
from pathlib import Path


def main(folder: str, name: str, stage: str) -> None:
    asset = Path(folder).resolve() / "assets" / name / f"{name}.usda"
    if not asset.is_file():
        sys.exit(f"{asset}: there is no such object")
    reference(asset, Path(stage))
    if importlib.util.find_spec("newton") is None:
        print("not run: Newton is not installed here (pip install 'newton[sim,importers]')")
        return
    open_joints(stage)


def reference(asset: Path, path: Path) -> None:
    """Write a stage with gravity and a reference to the asset, relative to the stage's folder."""
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.Scene.Define(stage, "/physics").CreateGravityMagnitudeAttr(9.81)
    unit = UsdGeom.Xform.Define(stage, "/World/unit")
    unit.GetPrim().GetReferences().AddReference(os.path.relpath(asset, path.resolve().parent))
    unit.AddTranslateOp().Set(Gf.Vec3d(1, 2, 0))
    stage.Save()


def open_joints(stage: str) -> None:
    """Apply a constant effort to each joint for 3 s, and print how far it opens."""
    import newton
    from newton.usd import SchemaResolverNewton, SchemaResolverPhysx

    builder = newton.ModelBuilder()
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    builder.add_usd(stage, schema_resolvers=[SchemaResolverNewton(), SchemaResolverPhysx()])
    model = builder.finalize(device="cpu")
    solver, control = newton.solvers.SolverMuJoCo(model), model.control()
    kinds, dofs = model.joint_type.numpy(), model.joint_qd_start.numpy()
    moving = [j for j, kind in enumerate(kinds) if kind in (newton.JointType.PRISMATIC, newton.JointType.REVOLUTE)]
    effort = control.joint_f.numpy()
    for joint in moving:
        effort[dofs[joint]] = 30.0 if kinds[joint] == newton.JointType.PRISMATIC else 10.0  # N, N m
    control.joint_f.assign(effort)
    now, after = model.state(), model.state()
    newton.eval_fk(model, model.joint_q, model.joint_qd, now)
    for _ in range(1500):
        now.clear_forces()
        solver.step(now, after, control, None, 0.002)
        now, after = after, now
    upper = model.joint_limit_upper.numpy()
    for joint in moving:
        position = now.joint_q.numpy()[model.joint_q_start.numpy()[joint]]
        print(f"{model.joint_label[joint].rsplit('/', 1)[-1]}: {position:.2f} of {upper[dofs[joint]]:.2f}")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
