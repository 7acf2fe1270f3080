"""Comparison of the values stored by a loader with those of scene.urdf, in the world frame."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from r2c2r_core.arrays import Matrix3, Points, Vector3
from r2c2r_core.export.plan import WORLD
from r2c2r_core.export.reading import Urdf, UrdfJoint, UrdfLink
from r2c2r_core.geometry.transforms import Rigid3

_LENGTH_M = 1e-4  # engines use single precision; a scene spans metres
_DIRECTION = 1e-3
_SHARE = 1e-3  # relative tolerance of inertias and joint resistances
_MASS_SHARE, _LEAST_MASS_KG = 1e-4, 0.01
_LIMIT = 1e-4  # rad or m


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldJoint:
    """One moving joint, with all joints closed. NaN: the loader supports the value but has none."""

    type: str
    axis_world: Vector3
    origin_world: Vector3
    lower: float
    upper: float
    damping: float | None = None  # None: the loader does not support this value
    friction: float | None = None
    effort: float | None = None
    velocity: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeldBody:
    """One rigid body, with all joints closed."""

    mass_kg: float
    com_world: Vector3
    inertia_world: Matrix3  # kg m^2 about the centre of mass, world axes
    rotation_world: Matrix3  # world_from_body
    origin_world: Vector3
    colliders: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Readback:
    """Joints and bodies as stored by a loader."""

    version: str
    joints: dict[str, HeldJoint]
    bodies: dict[str, HeldBody]
    problem: str = ""
    in_world: frozenset[str] = frozenset()  # links that the loader merges into the world, without a body
    steps_per_s: tuple[tuple[int, float], ...] = ()  # number of parallel worlds, and total steps per second

    @property
    def not_kept(self) -> tuple[str, ...]:
        """Names of joint values that this loader does not support."""
        return tuple(name for name in RESISTANCE if any(getattr(joint, name) is None for joint in self.joints.values()))


RESISTANCE = ("damping", "friction", "effort", "velocity")


def readback_of(document: dict[str, Any]) -> Readback:
    """Readback from a probe's document: plain lists and numbers by the names of the fields above."""
    joints = {name: HeldJoint(**_arrays(entry)) for name, entry in document["joints"].items()}
    bodies = {name: HeldBody(**_arrays(entry)) for name, entry in document["bodies"].items()}
    return Readback(
        version=document["version"],
        joints=joints,
        bodies=bodies,
        problem=document.get("problem", ""),
        in_world=frozenset(document.get("in_world", ())),
        steps_per_s=tuple((int(worlds), float(speed)) for worlds, speed in document.get("steps_per_s", {}).items()),
    )


def expected_readback(urdf: Urdf) -> Readback:
    """The values of scene.urdf that a loader must reproduce."""
    poses = urdf.world_poses()
    return Readback(
        version="",
        joints={
            joint.name: _expected_joint(joint, poses[joint.child])
            for joint in urdf.joints
            if joint.type in ("revolute", "prismatic") and joint.child in poses
        },
        bodies={link.name: _expected_body(link, poses[link.name]) for link in urdf.links if _has_mass(link, poses)},
    )


def differences(expected: Readback, found: Readback) -> list[str]:
    """Differences of a loader's values from scene.urdf, one phrase each."""
    lines = [found.problem] if found.problem else []
    lines += _set_differences("joint", set(expected.joints), set(found.joints))
    for name in sorted(set(expected.joints) & set(found.joints)):
        lines += [f"{name} {phrase}" for phrase in _joint_differences(expected.joints[name], found.joints[name])]
    lines += _set_differences("link", set(expected.bodies) - found.in_world, set(found.bodies))
    for name in sorted(set(expected.bodies) & set(found.bodies)):
        lines += [f"{name} {phrase}" for phrase in _body_differences(expected.bodies[name], found.bodies[name])]
    return lines


def _joint_differences(expected: HeldJoint, found: HeldJoint) -> Iterator[str]:
    if expected.type != found.type:
        yield f"is {found.type}, not {expected.type}"
        return
    if not _near(expected.axis_world, found.axis_world, _DIRECTION):
        yield f"has the axis {_numbers(found.axis_world)}, not {_numbers(expected.axis_world)}"
    if not _near(expected.origin_world, found.origin_world, _LENGTH_M):
        yield f"lies at {_numbers(found.origin_world)} m, not {_numbers(expected.origin_world)}"
    if not _near([expected.lower, expected.upper], [found.lower, found.upper], _LIMIT):
        yield f"has limits {found.lower:.4g} .. {found.upper:.4g}, not {expected.lower:.4g} .. {expected.upper:.4g}"
    for name in RESISTANCE:
        wanted, held = getattr(expected, name), getattr(found, name)
        if held is not None and not abs(held - wanted) <= _SHARE * max(abs(wanted), 1e-3):
            yield f"has {name} {held:.4g}, not {wanted:.4g}"


def _body_differences(expected: HeldBody, found: HeldBody) -> Iterator[str]:
    if not abs(expected.mass_kg - found.mass_kg) <= _MASS_SHARE * max(abs(expected.mass_kg), _LEAST_MASS_KG):
        yield f"weighs {found.mass_kg:.4g} kg, not {expected.mass_kg:.4g}"
    if not _near(expected.com_world, found.com_world, _LENGTH_M):
        yield f"has its centre of mass at {_numbers(found.com_world)} m, not {_numbers(expected.com_world)}"
    elif not _near(expected.inertia_world, found.inertia_world, _SHARE * float(np.abs(expected.inertia_world).max())):
        wanted, held = _moments(expected.inertia_world), _moments(found.inertia_world)
        turned = " about other axes" if _near(wanted, held, _SHARE * float(wanted.max())) else ""
        yield f"has the moments {_numbers(held)} kg m2{turned}, not {_numbers(wanted)}"
    if not _near(expected.origin_world, found.origin_world, _LENGTH_M):
        yield f"stands at {_numbers(found.origin_world)} m, not {_numbers(expected.origin_world)}"
    if not _near(expected.rotation_world, found.rotation_world, _DIRECTION):
        yield "has another orientation"
    if expected.colliders != found.colliders:
        yield f"has {found.colliders} of {expected.colliders} colliders"


def _expected_joint(joint: UrdfJoint, world_from_child: Rigid3) -> HeldJoint:
    values = {"lower": 0.0, "upper": 0.0, "effort": 0.0, "velocity": 0.0, "damping": 0.0, "friction": 0.0}
    values |= {k: v for k, v in ((joint.limit or {}) | (joint.dynamics or {})).items() if k in values}
    axis = world_from_child.turn(joint.axis)
    return HeldJoint(type=joint.type, axis_world=axis, origin_world=world_from_child.translation, **values)


def _expected_body(link: UrdfLink, world_from_link: Rigid3) -> HeldBody:
    assert link.inertial is not None  # ensured by _has_mass
    turn = world_from_link.rotation
    return HeldBody(
        mass_kg=link.inertial.mass_kg,
        com_world=world_from_link.apply(link.inertial.com_link),
        inertia_world=turn @ link.inertial.inertia @ turn.T,
        rotation_world=turn,
        origin_world=world_from_link.translation,
        colliders=sum(shape.kind == "collision" for shape in link.shapes),
    )


def _has_mass(link: UrdfLink, poses: dict[str, Rigid3]) -> bool:
    return link.inertial is not None and link.name != WORLD and link.name in poses


def _arrays(entry: dict[str, Any]) -> dict[str, Any]:
    return {k: np.array(v, dtype=np.float64) if isinstance(v, list | tuple | np.ndarray) else v for k, v in entry.items()}


def _near(expected: Any, found: Any, tolerance: float) -> bool:
    return bool(np.abs(np.subtract(expected, found)).max() <= tolerance)  # NaN is not near


def _moments(inertia: Matrix3) -> Vector3:
    return np.asarray(np.linalg.eigvalsh(inertia)) if np.isfinite(inertia).all() else np.full(3, np.nan)


def _numbers(values: Points | Vector3) -> str:
    return "(" + ", ".join(f"{v + 0.0:.4g}" for v in np.round(values, 5)) + ")"


def _set_differences(what: str, expected: set[str], found: set[str]) -> list[str]:
    lines = [f"{what} {name} is missing" for name in sorted(expected - found)]
    return lines + [f"{what} {name} is not in scene.urdf" for name in sorted(found - expected)]
