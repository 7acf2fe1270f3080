"""Read scene.usda with the USD library: its values, and the errors of the library's own validators."""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

_FRAMES_M = 1e-4  # single precision of joint frames metres away from the origin


def read_back(path: Path) -> dict[str, Any]:
    """Joints and bodies as stored in USD, lengths in metres, angles in radians; raises the library's own errors."""
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.Open(str(path))
    prims = list(stage.Traverse())
    problems = [*_wrong_units(stage), *_invalid(stage), *_joints_apart(prims)]
    cache = UsdGeom.XformCache()
    return {
        "version": f"USD {version('usd-core')}",
        "joints": {prim.GetName(): _joint(prim, cache) for prim in prims if _kind(prim)},
        "bodies": {p.GetName(): _body(p, cache) for p in prims if p.HasAPI(UsdPhysics.MassAPI)},
        "problem": problems[0] if problems else "",
    }


def _wrong_units(stage: Any) -> list[str]:
    from pxr import UsdGeom, UsdPhysics

    found = (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage))
    return [] if found == ("Z", 1.0, 1.0) else [f"up axis, metres and kilograms per unit are {found}, not ('Z', 1, 1)"]


def _invalid(stage: Any) -> list[str]:
    """Errors of every validator that comes with the library (composition, geometry, shading, physics)."""
    from pxr import UsdValidation

    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    serious = [e for e in errors if e.GetType() == UsdValidation.ValidationErrorType.Error]
    return [f"{len(serious)} errors by USD's validators, first {serious[0].GetMessage()}"] if serious else []


def _kind(prim: Any) -> str | None:
    from pxr import UsdPhysics

    if prim.IsA(UsdPhysics.RevoluteJoint):
        return "revolute"
    return "prismatic" if prim.IsA(UsdPhysics.PrismaticJoint) else None


def _joint(prim: Any, cache: Any) -> dict[str, Any]:
    """One joint; dry friction and velocity are in PhysX's schema PhysxJointAxisAPI."""
    from pxr import UsdPhysics

    kind = _kind(prim)
    schema, instance, unit = (
        (UsdPhysics.RevoluteJoint, "angular", np.pi / 180) if kind == "revolute" else (UsdPhysics.PrismaticJoint, "linear", 1.0)
    )
    joint, drive = schema(prim), UsdPhysics.DriveAPI(prim, instance)
    world_from_joint = _frame(prim, cache, joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr())
    physx = f"physxJointAxis:{instance}:"
    return {
        "type": kind,
        "axis_world": world_from_joint[:3, "XYZ".index(joint.GetAxisAttr().Get())].tolist(),
        "origin_world": world_from_joint[:3, 3].tolist(),
        "lower": _value(joint.GetLowerLimitAttr()) * unit,
        "upper": _value(joint.GetUpperLimitAttr()) * unit,
        "damping": _value(drive.GetDampingAttr()) / unit,
        "friction": _value(prim.GetAttribute(f"{physx}dynamicFrictionEffort")),
        "effort": _value(drive.GetMaxForceAttr()),
        "velocity": _value(prim.GetAttribute(f"{physx}maxJointVelocity")) * unit,
    }


def _body(prim: Any, cache: Any) -> dict[str, Any]:
    from pxr import Gf, UsdPhysics

    mass = UsdPhysics.MassAPI(prim)
    world_from_body = np.array(cache.GetLocalToWorldTransform(prim)).T
    turn = world_from_body[:3, :3]
    principal = turn @ np.array(Gf.Matrix3d(Gf.Quatd(mass.GetPrincipalAxesAttr().Get()))).T
    com = world_from_body @ [*mass.GetCenterOfMassAttr().Get(), 1.0]
    return {
        "mass_kg": _value(mass.GetMassAttr()),
        "com_world": com[:3].tolist(),
        "inertia_world": (principal @ np.diag(mass.GetDiagonalInertiaAttr().Get()) @ principal.T).tolist(),
        "rotation_world": turn.tolist(),
        "origin_world": world_from_body[:3, 3].tolist(),
        "colliders": sum(child.HasAPI(UsdPhysics.CollisionAPI) for child in prim.GetChildren()),
    }


def _value(attribute: Any) -> float:
    """An attribute's number; NaN where it is not authored."""
    value = attribute.Get() if attribute else None
    return float("nan") if value is None else float(value)


def _joints_apart(prims: list[Any]) -> list[str]:
    """Joints whose frame differs between their two bodies: an engine snaps them together on the first step."""
    from pxr import UsdGeom, UsdPhysics

    lines = []
    cache = UsdGeom.XformCache()
    for prim in prims:
        if not prim.IsA(UsdPhysics.Joint):
            continue
        joint = UsdPhysics.Joint(prim)
        first = _frame(prim, cache, joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr())
        second = _frame(prim, cache, joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr())
        apart = float(np.abs(first - second).max())
        if apart > _FRAMES_M:
            lines.append(f"{prim.GetName()}: its frame differs by {apart:.2g} between its two bodies")
    return lines


def _frame(prim: Any, cache: Any, body: Any, position: Any, rotation: Any) -> np.ndarray:
    """A joint's frame in the world, 4x4, as given by one of its bodies; no body means the world itself."""
    from pxr import Gf

    local = Gf.Matrix4d().SetRotate(Gf.Quatd(rotation.Get()))
    local.SetTranslateOnly(Gf.Vec3d(position.Get()))
    targets = body.GetTargets()
    if targets:
        local = local * cache.GetLocalToWorldTransform(prim.GetStage().GetPrimAtPath(targets[0]))
    return np.array(local).T


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(Path(sys.argv[1]))))
