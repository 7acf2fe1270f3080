"""scene.xml: MuJoCo's own format, with features URDF lacks: textures, free bodies, a floor, contact exclusions.

Visual geoms are in group 2 and collide with nothing; colliders are in group 3. Inertials are explicit, angles are radians.
"""

import xml.etree.ElementTree as ET
from pathlib import Path

from r2c2r_core.export.assets import asset_file, assets_of
from r2c2r_core.export.contacts import CARRIED_BY
from r2c2r_core.export.labels import labels_of, labels_of_handle
from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.preview import poses_at
from r2c2r_core.export.states import State, states_of
from r2c2r_core.export.writers.stand import add_surroundings, add_view
from r2c2r_core.export.writers.text import numbers, quat_wxyz_of, words_of
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.materials import ARMATURE, SURFACE_FRICTION

_HOLDS = "0.99 0.99 0.001"
"""Impedance of dry friction in joints. At MuJoCo's own, 0.9, it creeps: a flap of 0.8 m hung on its upper edge sags open by
1.7 mm in five seconds, whatever its friction; at this by 0.2 mm."""
_NAMES = {"name", "mesh", "texture", "material", "body1", "body2"}
"""Attributes that name an element of the document."""

_FRICTION = f"{SURFACE_FRICTION} 0.01 0.001"  # sliding, spinning, rolling


def write_mjcf(plan: Plan, path: Path) -> None:
    """Write the plan as one MJCF document with paths relative to its folder, and each object's asset.

    The scene does not attach the assets, as importers with their own MJCF parser do not support <attach>.
    """
    path.write_text(mjcf_text(plan))
    for asset in assets_of(plan):
        file = path.parent / asset_file(asset.name, ".xml")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(asset_mjcf_text(asset))


def asset_mjcf_text(plan: Plan) -> str:
    """One object's MJCF, with names without the object's name, which a scene adds as the prefix when attaching it."""
    root = ET.Element("mujoco", model=plan.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    _add_defaults(root)
    _add_assets(ET.SubElement(root, "asset"), plan)
    _add_bodies(root, ET.SubElement(root, "worldbody"), plan)
    for element in root.iter():
        for key in _NAMES & element.attrib.keys():
            element.set(key, element.attrib[key].removeprefix(f"{plan.name}_"))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def mjcf_text(plan: Plan) -> str:
    """The MJCF document."""
    root = ET.Element("mujoco", model=plan.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", timestep="0.002", integrator="implicitfast")
    add_view(root, plan)
    _add_defaults(root)
    asset = ET.SubElement(root, "asset")
    _add_floor_look(asset)
    _add_assets(asset, plan)
    worldbody = ET.SubElement(root, "worldbody")
    add_surroundings(worldbody, plan, {"friction": _FRICTION})
    _add_bodies(root, worldbody, plan)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _add_bodies(root: ET.Element, worldbody: ET.Element, plan: Plan) -> None:
    """Add bodies, their semantics, and contact exclusions."""
    elements = {WORLD: worldbody}
    for body in plan.bodies:
        elements[body.name] = _add_body(elements[WORLD if body.free else body.parent], body)
        _add_sites(elements[body.name], body, plan)
    _add_meaning(root, plan)
    contact = ET.SubElement(root, "contact")
    for body in plan.bodies:
        if body.parent != WORLD and not body.free:
            ET.SubElement(contact, "exclude", name=f"{body.name}_parent", body1=body.parent, body2=body.name)
    _add_states(root, worldbody, plan)


def _add_states(root: ET.Element, worldbody: ET.Element, plan: Plan) -> None:
    """Add a keyframe for each state: positions in MuJoCo's body order, which is the document's."""
    bodies = [plan.body(element.attrib["name"]) for element in worldbody.iter("body")]
    keyframe = ET.SubElement(root, "keyframe")
    for name, state in states_of(plan).items():
        poses = poses_at(plan, state.share, state.joints)
        qpos = [value for body in bodies for value in _positions(body, state, poses[body.name])]
        if qpos:
            ET.SubElement(keyframe, "key", name=name, qpos=numbers(qpos))


def _positions(body: Body, state: State, world_from_body: Rigid3) -> list[float]:
    """Generalised positions of a body: its joint's, or its pose if it is free."""
    if body.free:
        return [*world_from_body.translation, *quat_wxyz_of(world_from_body.rotation)]
    return [] if body.joint is None else [state.position(body)]


def _add_meaning(root: ET.Element, plan: Plan) -> None:
    """Add <custom> texts named like bodies and sites: `category=…;part=…;disposition=…` (several: by commas).

    The text of a free body in a drawer ends with `carried_by=…`, the drawer's body.
    """
    custom = ET.SubElement(root, "custom")
    carriers = {body.name: {CARRIED_BY: body.parent} for body in plan.bodies if body.free and body.parent != WORLD}
    said = [(body.name, labels_of(body)) for body in plan.bodies]
    said += [(handle.name, labels_of_handle(handle, plan.body(handle.link))) for handle in plan.handles]
    for name, labels in said:
        words = words_of(labels) | carriers.get(name, {})
        ET.SubElement(custom, "text", name=name, data=";".join(f"{key}={value}" for key, value in words.items()))


def _add_defaults(root: ET.Element) -> None:
    default = ET.SubElement(root, "default")
    seen = ET.SubElement(default, "default", {"class": "visual"})
    ET.SubElement(seen, "geom", group="2", contype="0", conaffinity="0", mass="0")
    touched = ET.SubElement(default, "default", {"class": "collision"})
    ET.SubElement(touched, "geom", group="3", friction=_FRICTION, rgba="0.5 0.6 0.7 0.4")


def _add_floor_look(asset: ET.Element) -> None:
    sky = {"type": "skybox", "builtin": "gradient", "rgb1": "0.93 0.94 0.96", "rgb2": "0.7 0.75 0.8"}
    ET.SubElement(asset, "texture", {"name": "sky", "width": "64", "height": "64", **sky})
    checker = {"type": "2d", "builtin": "checker", "rgb1": "0.8 0.79 0.77", "rgb2": "0.78 0.77 0.75"}
    ET.SubElement(asset, "texture", {"name": "floor", "width": "256", "height": "256", **checker})
    ET.SubElement(asset, "material", name="floor", texture="floor", texrepeat="2 2", texuniform="true", reflectance="0")


def _add_assets(asset: ET.Element, plan: Plan) -> None:
    textures: dict[str, str] = {}
    for body in plan.bodies:
        if body.visual_file is not None and body.texture_file is not None:
            texture = textures.setdefault(body.texture_file, f"{body.name}_tex")
            if texture == f"{body.name}_tex":
                ET.SubElement(asset, "texture", name=texture, type="2d", file=body.texture_file)
                ET.SubElement(asset, "material", name=texture, texture=texture, specular="0.1", shininess="0.1")
            # inertia="shell": a fitted visual may be open or thin, which a volume integral rejects
            ET.SubElement(asset, "mesh", name=f"{body.name}_vis", file=body.visual_file, inertia="shell")
        for number, name in enumerate(body.collision_files):
            ET.SubElement(asset, "mesh", name=f"{body.name}_col_{number}", file=name)


def _add_body(parent: ET.Element, body: Body) -> ET.Element:
    pose = body.world_from_body if body.free else body.parent_from_body
    element = ET.SubElement(parent, "body", {"name": body.name, **_pose(pose)})
    if body.joint is not None and body.joint.has_stay:
        element.set("gravcomp", "1")
    inertial = body.link.inertial
    full = [inertial.inertia[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    mass = {"pos": numbers(inertial.com_link), "mass": numbers(inertial.mass_kg), "fullinertia": numbers(full)}
    ET.SubElement(element, "inertial", mass)
    if body.free:
        ET.SubElement(element, "freejoint", name=f"{body.name}_free")
    if body.joint is not None:
        _add_joint(element, body)
    _add_visuals(element, body)
    for number, _ in enumerate(body.collision_files):
        name = f"{body.name}_col_{number}"
        ET.SubElement(element, "geom", {"class": "collision", "name": name, "type": "mesh", "mesh": name})
    for number, box in enumerate(body.link.boxes, start=len(body.collision_files)):
        shape = {"name": f"{body.name}_col_{number}", "type": "box", "size": numbers(box.size_m / 2)}
        ET.SubElement(element, "geom", {"class": "collision", **shape, **_pose(box.link_from_box)})
    return element


def _add_visuals(element: ET.Element, body: Body) -> None:
    if body.visual_file is not None:
        material = f"{Path(body.texture_file or '').stem.removesuffix('_vis')}_tex"
        shape = {"name": f"{body.name}_vis", "type": "mesh", "mesh": f"{body.name}_vis", "material": material}
        ET.SubElement(element, "geom", {"class": "visual", **shape})
        return
    for number, box in enumerate(body.link.boxes):
        shape = {"name": f"{body.name}_vis_{number}", "type": "box", "size": numbers(box.size_m / 2)}
        colour = {"rgba": numbers([*body.link.colour, 1.0])}
        ET.SubElement(element, "geom", {"class": "visual", **shape, **colour, **_pose(box.link_from_box)})


def _add_sites(element: ET.Element, body: Body, plan: Plan) -> None:
    """Add a site at each handle, z into the front and x along the grip: a box of the grip's size, or a small ball to push."""
    for handle in plan.handles_of(body.name):
        pose = _pose(body.world_from_body.inverse @ handle.world_from_handle)
        grip = (
            {"type": "sphere", "size": "0.005"}
            if handle.kind == "push"
            else {"type": "box", "size": numbers(handle.size_m / 2)}
        )
        ET.SubElement(element, "site", {"name": handle.name, **grip, "group": "4", **pose})


def _add_joint(element: ET.Element, body: Body) -> None:
    joint = body.joint
    assert joint is not None
    ET.SubElement(
        element,
        "joint",
        name=body.joint_name,
        type="hinge" if joint.type == "revolute" else "slide",
        axis=numbers(body.axis_body),
        range=numbers([joint.lower, joint.upper]),
        damping=numbers(joint.damping),
        frictionloss=numbers(joint.friction),
        solimpfriction=_HOLDS,
        armature=numbers(ARMATURE[joint.type]),
        actuatorfrcrange=numbers([-joint.effort, joint.effort]),
    )


def _pose(pose: Rigid3) -> dict[str, str]:
    return {"pos": numbers(pose.translation), "quat": numbers(quat_wxyz_of(pose.rotation))}
