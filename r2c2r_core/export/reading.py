"""Lenient URDF parser of the linter and the certificate, so that every defect can be reported."""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from r2c2r_core.arrays import Matrix3, Vector3
from r2c2r_core.errors import BundleError
from r2c2r_core.export.writers.text import rotation_of
from r2c2r_core.geometry.transforms import Rigid3

MOVING = ("revolute", "prismatic", "continuous")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfShape:
    """One <visual> or <collision>: a mesh file, a box, or another primitive (then both are None)."""

    kind: str  # "visual" or "collision"
    name: str
    link_from_shape: Rigid3
    mesh: str | None
    scale: Vector3
    box_m: Vector3 | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfInertial:
    """One <inertial>; numbers that could not be read are NaN."""

    mass_kg: float
    com_link: Vector3
    inertia: Matrix3  # about the centre of mass, in link axes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfLink:
    """One <link>."""

    name: str
    inertial: UrdfInertial | None
    shapes: tuple[UrdfShape, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfJoint:
    """One <joint>; `limit` has only the attributes that are present."""

    name: str
    type: str
    parent: str
    child: str
    parent_from_child: Rigid3
    axis: Vector3
    limit: dict[str, float] | None
    dynamics: dict[str, float] | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Urdf:
    """A robot description; duplicates are kept."""

    name: str
    links: tuple[UrdfLink, ...]
    joints: tuple[UrdfJoint, ...]
    mujoco_compiler: dict[str, str] | None
    malformed: tuple[tuple[str, str], ...]  # (where, what) of numbers that could not be read

    @property
    def roots(self) -> tuple[str, ...]:
        """Names of links that are not the child of any joint."""
        children = {joint.child for joint in self.joints}
        return tuple(link.name for link in self.links if link.name not in children)

    def world_poses(self) -> dict[str, Rigid3]:
        """root_from_link of every link that a root reaches, all joints at zero."""
        poses = {root: Rigid3() for root in self.roots}
        waiting = list(self.joints)
        while waiting:
            ready = [joint for joint in waiting if joint.parent in poses]
            if not ready:
                break
            for joint in ready:
                poses.setdefault(joint.child, poses[joint.parent] @ joint.parent_from_child)
            waiting = [joint for joint in waiting if joint not in ready]
        return poses


def read_urdf(path: Path) -> Urdf:
    """Parse a URDF; raises BundleError when the file is not one."""
    try:
        root = ET.fromstring(path.read_bytes())
    except FileNotFoundError as error:
        raise BundleError(f"{path.name} is missing", hint="expected a bundle with scene.urdf at its top") from error
    except (ET.ParseError, ValueError, OSError) as error:
        raise BundleError(f"{path.name} is not XML: {error}", hint="export the bundle again") from error
    if root.tag != "robot":
        raise BundleError(f"{path.name} holds <{root.tag}>, not <robot>", hint="export the bundle again")
    reader = _Reader()
    links = tuple(reader.link(element) for element in root.findall("link"))
    joints = tuple(reader.joint(element) for element in root.findall("joint"))
    compiler = root.find("mujoco/compiler")
    return Urdf(
        name=root.get("name", ""),
        links=links,
        joints=joints,
        mujoco_compiler=None if compiler is None else dict(compiler.attrib),
        malformed=tuple(reader.malformed),
    )


class _Reader:
    """Converts elements to dataclasses; collects unreadable numbers instead of stopping at the first."""

    def __init__(self) -> None:
        self.malformed: list[tuple[str, str]] = []

    def link(self, element: ET.Element) -> UrdfLink:
        name = element.get("name", "")
        shapes = [self.shape(shape, name) for shape in element if shape.tag in ("visual", "collision")]
        inertial = element.find("inertial")
        return UrdfLink(name=name, inertial=None if inertial is None else self.inertial(inertial, name), shapes=tuple(shapes))

    def inertial(self, element: ET.Element, where: str) -> UrdfInertial:
        pose = self.pose(element, where)
        mass, inertia = element.find("mass"), element.find("inertia")
        entries = {
            key: self.numbers(None if inertia is None else inertia.get(key, "0" if key[1] != key[2] else None), 1, where)[0]
            for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        }
        own = np.array(
            [
                [entries["ixx"], entries["ixy"], entries["ixz"]],
                [entries["ixy"], entries["iyy"], entries["iyz"]],
                [entries["ixz"], entries["iyz"], entries["izz"]],
            ]
        )
        return UrdfInertial(
            mass_kg=float(self.numbers(None if mass is None else mass.get("value"), 1, where)[0]),
            com_link=pose.translation,
            inertia=pose.rotation @ own @ pose.rotation.T,
        )

    def shape(self, element: ET.Element, link: str) -> UrdfShape:
        mesh, box = element.find("geometry/mesh"), element.find("geometry/box")
        return UrdfShape(
            kind=element.tag,
            name=element.get("name", ""),
            link_from_shape=self.pose(element, link),
            mesh=None if mesh is None else mesh.get("filename", ""),
            scale=np.ones(3) if mesh is None else self.numbers(mesh.get("scale", "1 1 1"), 3, link),
            box_m=None if box is None else self.numbers(box.get("size"), 3, link),
        )

    def joint(self, element: ET.Element) -> UrdfJoint:
        name = element.get("name", "")
        parent, child, axis = element.find("parent"), element.find("child"), element.find("axis")
        return UrdfJoint(
            name=name,
            type=element.get("type", ""),
            parent="" if parent is None else parent.get("link", ""),
            child="" if child is None else child.get("link", ""),
            parent_from_child=self.pose(element, name),
            axis=self.numbers("1 0 0" if axis is None else axis.get("xyz"), 3, name),
            limit=self.attributes(element.find("limit"), name),
            dynamics=self.attributes(element.find("dynamics"), name),
        )

    def attributes(self, element: ET.Element | None, where: str) -> dict[str, float] | None:
        if element is None:
            return None
        return {key: float(self.numbers(value, 1, where)[0]) for key, value in element.attrib.items()}

    def pose(self, element: ET.Element, where: str) -> Rigid3:
        origin = element.find("origin")
        if origin is None:
            return Rigid3()
        return Rigid3(
            rotation_of(self.numbers(origin.get("rpy", "0 0 0"), 3, where)),
            self.numbers(origin.get("xyz", "0 0 0"), 3, where),
        )

    def numbers(self, text: str | None, count: int, where: str) -> np.ndarray:
        try:
            values = [float(word) for word in (text or "").split()]
        except ValueError:
            values = []
        if len(values) != count or not all(math.isfinite(v) for v in values):
            self.malformed.append((where, repr(text)))
            return np.full(count, np.nan)
        return np.array(values)
