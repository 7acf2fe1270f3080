"""scene.urdf: what yourdfpy, MuJoCo, PyBullet, SAPIEN and ROS all read without an edit.

- One root link `world`, without mass and geometry: PyBullet then holds the scene still without `useFixedBase` (with a mass
  it falls: measured), and every other link carries an inertial.
- Free-standing things are joined by `fixed` joints here. `floating` would be the word for it, but PyBullet turns it into a
  fixed joint with a warning, yourdfpy's `update_cfg(zero_cfg)` raises on it and viser shows a dead slider for it (measured
  with 3.2.7, 0.0.60 and 1.1.1); scene.xml gives the same things a free joint, so they move in MuJoCo.
- The `<mujoco>` block keeps visuals and static bodies in MuJoCo; the others ignore it.
"""

import xml.etree.ElementTree as ET
from pathlib import Path

from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.writers.text import numbers, rpy_of
from r2c2r_core.geometry.transforms import Rigid3


def write_urdf(plan: Plan, path: Path) -> None:
    """Write the plan as one URDF with paths relative to its folder."""
    path.write_text(urdf_text(plan))


def urdf_text(plan: Plan) -> str:
    """The URDF document."""
    robot = ET.Element("robot", name=plan.name)
    mujoco = ET.SubElement(robot, "mujoco")
    ET.SubElement(mujoco, "compiler", strippath="false", discardvisual="false", fusestatic="false")
    ET.SubElement(robot, "link", name=WORLD)
    for body in plan.bodies:
        _add_link(robot, body)
        _add_joint(robot, body)
    ET.indent(robot)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _add_link(robot: ET.Element, body: Body) -> None:
    link = ET.SubElement(robot, "link", name=body.name)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=numbers(body.link.inertial.com_link), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=numbers(body.link.inertial.mass_kg))
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    inertia = body.link.inertial.inertia
    ET.SubElement(inertial, "inertia", {name: numbers(inertia[entry]) for name, entry in entries.items()})
    if body.visual_file is not None:
        _add_mesh(link, "visual", f"{body.name}_vis", body.visual_file)
    for number, box in enumerate(body.link.boxes):
        if body.visual_file is None:
            _add_box(link, "visual", f"{body.name}_vis_{number}", box.size_m, box.link_from_box)
            material = ET.SubElement(link[-1], "material", name=f"{body.name}_colour")
            ET.SubElement(material, "color", rgba=numbers([*body.link.colour, 1.0]))
    for number, name in enumerate(body.collision_files):
        _add_mesh(link, "collision", f"{body.name}_col_{number}", name)
    for number, box in enumerate(body.link.boxes, start=len(body.collision_files)):
        _add_box(link, "collision", f"{body.name}_col_{number}", box.size_m, box.link_from_box)


def _add_mesh(link: ET.Element, kind: str, name: str, file: str) -> None:
    element = ET.SubElement(link, kind, name=name)
    ET.SubElement(element, "origin", xyz="0 0 0", rpy="0 0 0")
    ET.SubElement(ET.SubElement(element, "geometry"), "mesh", filename=file)


def _add_box(link: ET.Element, kind: str, name: str, size_m: object, link_from_box: Rigid3) -> None:
    element = ET.SubElement(link, kind, name=name)
    _add_origin(element, link_from_box)
    ET.SubElement(ET.SubElement(element, "geometry"), "box", size=numbers(size_m))


def _add_joint(robot: ET.Element, body: Body) -> None:
    joint = body.joint
    element = ET.SubElement(robot, "joint", name=body.joint_name, type="fixed" if joint is None else joint.type)
    _add_origin(element, body.parent_from_body)
    ET.SubElement(element, "parent", link=body.parent)
    ET.SubElement(element, "child", link=body.name)
    if joint is not None:
        ET.SubElement(element, "axis", xyz=numbers(body.axis_body))
        limit = {"lower": joint.lower, "upper": joint.upper, "effort": joint.effort, "velocity": joint.velocity}
        ET.SubElement(element, "limit", {name: numbers(value) for name, value in limit.items()})
        ET.SubElement(element, "dynamics", damping=numbers(joint.damping), friction=numbers(joint.friction))


def _add_origin(element: ET.Element, pose: Rigid3) -> None:
    ET.SubElement(element, "origin", xyz=numbers(pose.translation), rpy=numbers(rpy_of(pose.rotation)))
