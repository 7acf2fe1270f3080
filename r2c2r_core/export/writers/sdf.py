"""scene.sdf: a world for Gazebo and Drake, with a model for each object; paths relative to its folder.

A base is fixed to the world by a joint; only free-standing objects have none and can fall.
"""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np

from r2c2r_core.export.assets import assets_of, world_from_asset
from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.writers.stand import AMBIENT, CAMERA, FOVY_DEG, PICTURE, SUN, SUNLIGHT, view_of
from r2c2r_core.export.writers.text import numbers, rpy_of
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.materials import SURFACE_FRICTION

_FLOOR_M = (20.0, 20.0, 0.1)
_CAMERA_FROM_SENSOR = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])  # a sensor looks along +X, +Z up


def write_sdf(plan: Plan, path: Path) -> None:
    """Write the plan as one SDF 1.9 world."""
    path.write_text(sdf_text(plan))


def sdf_text(plan: Plan) -> str:
    """The SDF document."""
    root = ET.Element("sdf", version="1.9")
    world = ET.SubElement(root, "world", name=plan.name)
    _add_surroundings(world, plan)
    plates = [body for body in plan.bodies if body.is_support]
    for asset in assets_of(plan):
        model = _add_model(world, asset.name, world_from_asset(plan, asset.name))
        for body in asset.bodies:
            _add_link(model, replace(body, folder=plan.body(body.name).folder))  # paths relative to the scene
            _add_joint(model, body)
    for plate in plates:
        model = _add_model(world, plate.name, Rigid3())
        _add_link(model, plate)
        _add_joint(model, plate)
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add_model(world: ET.Element, name: str, pose: Rigid3) -> ET.Element:
    model = ET.SubElement(world, "model", name=name)
    _add_pose(model, pose)
    return model


def _add_surroundings(world: ET.Element, plan: Plan) -> None:
    """Add light, and the floor with a camera. The floor is a plate: Drake 1.51 crashes on a plane that precedes meshes."""
    view = view_of(plan)
    ET.SubElement(ET.SubElement(world, "scene"), "ambient").text = numbers([*[AMBIENT] * 3, 1.0])
    sun = ET.SubElement(world, "light", name=SUN, type="directional")
    ET.SubElement(sun, "cast_shadows").text = "true"
    ET.SubElement(sun, "diffuse").text = numbers([*[SUNLIGHT] * 3, 1.0])
    ET.SubElement(sun, "specular").text = "0 0 0 1"
    ET.SubElement(sun, "direction").text = numbers(-view.sun)
    model = ET.SubElement(world, "model", name="floor")
    ET.SubElement(model, "static").text = "true"
    ET.SubElement(model, "pose").text = f"0 0 {numbers(plan.floor_z_m - _FLOOR_M[2] / 2)} 0 0 0"
    link = ET.SubElement(model, "link", name="floor_link")
    for kind in ("collision", "visual"):
        shape = ET.SubElement(link, kind, name=f"floor_{kind}")
        _add_box(shape, Rigid3(), _FLOOR_M)
    sensor = ET.SubElement(link, "sensor", name=CAMERA, type="camera")
    floor_from_world = Rigid3(translation=np.array([0.0, 0.0, _FLOOR_M[2] / 2 - plan.floor_z_m]))
    _add_pose(sensor, floor_from_world @ view.world_from_camera @ Rigid3(_CAMERA_FROM_SENSOR))
    camera = ET.SubElement(sensor, "camera")
    slope = np.tan(np.radians(FOVY_DEG) / 2) * PICTURE[0] / PICTURE[1]
    ET.SubElement(camera, "horizontal_fov").text = numbers(2 * np.arctan(slope))
    image = ET.SubElement(camera, "image")
    for key, pixels in zip(("width", "height"), PICTURE, strict=True):
        ET.SubElement(image, key).text = str(pixels)


def _add_link(model: ET.Element, body: Body) -> None:
    link = ET.SubElement(model, "link", name=body.name)
    _add_pose(link, body.world_from_body)
    if body.joint is not None and body.joint.has_stay:
        ET.SubElement(link, "gravity").text = "false"
    inertial = ET.SubElement(link, "inertial")
    _add_pose(inertial, Rigid3(translation=body.link.inertial.com_link))
    ET.SubElement(inertial, "mass").text = numbers(body.link.inertial.mass_kg)
    inertia = ET.SubElement(inertial, "inertia")
    for key, entry in {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}.items():
        ET.SubElement(inertia, key).text = numbers(body.link.inertial.inertia[entry])
    if body.visual_file is not None:
        _add_mesh(ET.SubElement(link, "visual", name=f"{body.name}_vis"), body.visual_file)
    for number, box in enumerate(body.link.boxes):
        if body.visual_file is None:
            visual = ET.SubElement(link, "visual", name=f"{body.name}_vis_{number}")
            _add_box(visual, box.link_from_box, box.size_m)
            ET.SubElement(ET.SubElement(visual, "material"), "diffuse").text = numbers([*body.link.colour, 1.0])
    for number, file in enumerate(body.collision_files):
        shape = ET.SubElement(link, "collision", name=f"{body.name}_col_{number}")
        _add_mesh(shape, file)
        _add_surface(shape)
    for number, box in enumerate(body.link.boxes, start=len(body.collision_files)):
        shape = ET.SubElement(link, "collision", name=f"{body.name}_col_{number}")
        _add_box(shape, box.link_from_box, box.size_m)
        _add_surface(shape)


def _add_mesh(element: ET.Element, file: str) -> None:
    ET.SubElement(ET.SubElement(ET.SubElement(element, "geometry"), "mesh"), "uri").text = file


def _add_box(element: ET.Element, pose: Rigid3, size_m: object) -> None:
    _add_pose(element, pose)
    ET.SubElement(ET.SubElement(ET.SubElement(element, "geometry"), "box"), "size").text = numbers(size_m)


def _add_surface(shape: ET.Element) -> None:
    ode = ET.SubElement(ET.SubElement(ET.SubElement(shape, "surface"), "friction"), "ode")
    ET.SubElement(ode, "mu").text = numbers(SURFACE_FRICTION)
    ET.SubElement(ode, "mu2").text = numbers(SURFACE_FRICTION)


def _add_joint(model: ET.Element, body: Body) -> None:
    """Add a joint at the child's frame, in whose axes SDF gives the joint axis; a free base has none."""
    joint = body.joint
    if body.free:
        return
    element = ET.SubElement(model, "joint", name=body.joint_name, type="fixed" if joint is None else joint.type)
    ET.SubElement(element, "parent").text = WORLD if body.parent == WORLD else body.parent
    ET.SubElement(element, "child").text = body.name
    if joint is None:
        return
    axis = ET.SubElement(element, "axis")
    ET.SubElement(axis, "xyz").text = numbers(body.axis_body)
    limit, dynamics = ET.SubElement(axis, "limit"), ET.SubElement(axis, "dynamics")
    for key in ("lower", "upper", "effort", "velocity"):
        ET.SubElement(limit, key).text = numbers(getattr(joint, key))
    for key in ("damping", "friction"):
        ET.SubElement(dynamics, key).text = numbers(getattr(joint, key))
    for key in ("spring_reference", "spring_stiffness"):  # required by SDFormat, though their default is 0
        ET.SubElement(dynamics, key).text = "0"


def _add_pose(element: ET.Element, pose: Rigid3) -> None:
    ET.SubElement(element, "pose").text = f"{numbers(pose.translation)} {numbers(rpy_of(pose.rotation))}"
