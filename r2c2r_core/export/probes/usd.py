"""Read scene.usda with the USD library: what it holds, and what the library's own validators say of it."""

from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_FRAMES_M = 1e-4  # single precision of joint frames metres away from the origin


class UsdReadback(NamedTuple):
    """The scene as USD holds it, lengths in metres, angles in radians."""

    version: str
    joints: dict[str, tuple[str, float, float]]
    masses: dict[str, float]
    colliders: dict[str, int]
    problem: str


def read_usd(path: Path) -> UsdReadback:
    """Joints, masses and colliders by body; raises what the library raises on a file it cannot read."""
    from pxr import Usd

    stage = Usd.Stage.Open(str(path))
    prims = list(stage.Traverse())
    problems = [*_wrong_units(stage), *_invalid(stage), *_joints_apart(prims)]
    return UsdReadback(
        version=f"USD {version('usd-core')}",
        joints={name: found for prim in prims if (found := _joint(prim)) for name in (prim.GetName(),)},
        masses=_masses(prims),
        colliders=_colliders(prims),
        problem=problems[0] if problems else "",
    )


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


def _joint(prim: Any) -> tuple[str, float, float] | None:
    from pxr import UsdPhysics

    if prim.IsA(UsdPhysics.RevoluteJoint):
        joint, kind, unit = UsdPhysics.RevoluteJoint(prim), "revolute", np.pi / 180
    elif prim.IsA(UsdPhysics.PrismaticJoint):
        joint, kind, unit = UsdPhysics.PrismaticJoint(prim), "prismatic", 1.0
    else:
        return None
    return kind, float(joint.GetLowerLimitAttr().Get() * unit), float(joint.GetUpperLimitAttr().Get() * unit)


def _masses(prims: list[Any]) -> dict[str, float]:
    from pxr import UsdPhysics

    return {p.GetName(): float(UsdPhysics.MassAPI(p).GetMassAttr().Get()) for p in prims if p.HasAPI(UsdPhysics.MassAPI)}


def _colliders(prims: list[Any]) -> dict[str, int]:
    from pxr import UsdPhysics

    found: dict[str, int] = {}
    for prim in prims:
        if prim.HasAPI(UsdPhysics.CollisionAPI) and prim.GetParent().HasAPI(UsdPhysics.MassAPI):
            name = prim.GetParent().GetName()
            found[name] = found.get(name, 0) + 1
    return found


def _joints_apart(prims: list[Any]) -> list[str]:
    """Joints whose frame lies elsewhere when seen from their two bodies: an engine snaps them together on the first step."""
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
    """A joint's frame in the world, 4x4, as one of its bodies places it; no body is the world itself."""
    from pxr import Gf

    local = Gf.Matrix4d().SetRotate(Gf.Quatd(rotation.Get()))
    local.SetTranslateOnly(Gf.Vec3d(position.Get()))
    targets = body.GetTargets()
    if targets:
        local = local * cache.GetLocalToWorldTransform(prim.GetStage().GetPrimAtPath(targets[0]))
    return np.array(local).T
