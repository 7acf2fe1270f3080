"""scene.urdf: readable without changes by yourdfpy, MuJoCo, PyBullet, SAPIEN and ROS.

- One root link `world`, without mass and geometry: PyBullet then fixes the scene without `useFixedBase` (with a mass
  it falls; without one but another name it warns: measured), and every other link has an inertial.
- Free-standing objects have `fixed` joints here. `floating` would be correct, but PyBullet turns it into a fixed joint with
  a warning, yourdfpy's `update_cfg(zero_cfg)` raises on it and viser shows a dead slider for it (measured with 3.2.7,
  0.0.60 and 1.1.1); in scene.xml the same objects have a free joint, so they move in MuJoCo.
- The `<mujoco>` block keeps visuals and static bodies in MuJoCo; the others ignore it.
"""

import xml.etree.ElementTree as ET
from pathlib import Path

from r2c2r_core.export.assets import asset_file, assets_of
from r2c2r_core.export.labels import labels_of, labels_of_handle
from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.writers.text import numbers, rpy_of, words_of
from r2c2r_core.geometry.transforms import Rigid3


def write_urdf(plan: Plan, path: Path) -> None:
    """Write the plan as one URDF with paths relative to its folder, an SRDF beside it, and each object's asset."""
    path.write_text(urdf_text(plan))
    path.with_suffix(".srdf").write_text(srdf_text(plan))
    for asset in assets_of(plan):
        file = path.parent / asset_file(asset.name, ".urdf")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(urdf_text(asset, root=None if asset.bodies[0].free else WORLD))


def srdf_text(plan: Plan) -> str:
    """SRDF with disabled collision pairs of joined links, as read by MoveIt and SAPIEN."""
    robot = ET.Element("robot", name=plan.name)
    for body in plan.bodies:
        if body.parent != WORLD:
            ET.SubElement(robot, "disable_collisions", link1=body.parent, link2=body.name, reason="Adjacent")
    ET.indent(robot)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def urdf_text(plan: Plan, root: str | None = WORLD) -> str:
    """The URDF document; `root` names its bare first link; with None the first body is the root, as for a free object."""
    robot = ET.Element("robot", name=plan.name)
    mujoco = ET.SubElement(robot, "mujoco")
    ET.SubElement(mujoco, "compiler", strippath="false", discardvisual="false", fusestatic="false")
    if root is not None:
        ET.SubElement(robot, "link", name=root)
    for body in plan.bodies:
        _add_link(robot, body)
        parent = root if body.parent == WORLD else body.parent
        if parent is not None:
            _add_joint(robot, body, parent)
    _add_meaning(robot, plan)
    ET.indent(robot)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _add_meaning(robot: ET.Element, plan: Plan) -> None:
    """Add <r2c2r>, data without a URDF element, listed in README.txt. URDF readers ignore unknown elements."""
    extension = ET.SubElement(robot, "r2c2r", version="1")
    for body in plan.bodies:
        ET.SubElement(extension, "labels", {"link": body.name, **words_of(labels_of(body))})
    for handle in plan.handles:
        body = plan.body(handle.link)
        said = {"name": handle.name, "link": handle.link, "joint": handle.joint, "kind": handle.kind}
        labels = words_of(labels_of_handle(handle, body))
        element = ET.SubElement(extension, "handle", {**said, "size": numbers(handle.size_m), **labels})
        _add_origin(element, body.world_from_body.inverse @ handle.world_from_handle)


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


def _add_joint(robot: ET.Element, body: Body, parent: str) -> None:
    joint = body.joint
    element = ET.SubElement(robot, "joint", name=body.joint_name, type="fixed" if joint is None else joint.type)
    _add_origin(element, body.parent_from_body)
    ET.SubElement(element, "parent", link=parent)
    ET.SubElement(element, "child", link=body.name)
    if joint is not None:
        ET.SubElement(element, "axis", xyz=numbers(body.axis_body))
        limit = {"lower": joint.lower, "upper": joint.upper, "effort": joint.effort, "velocity": joint.velocity}
        ET.SubElement(element, "limit", {name: numbers(value) for name, value in limit.items()})
        ET.SubElement(element, "dynamics", damping=numbers(joint.damping), friction=numbers(joint.friction))


def _add_origin(element: ET.Element, pose: Rigid3) -> None:
    ET.SubElement(element, "origin", xyz=numbers(pose.translation), rpy=numbers(rpy_of(pose.rotation)))
