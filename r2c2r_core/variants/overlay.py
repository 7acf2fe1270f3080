"""A variation as MJCF: scene.xml with changed values, sharing the meshes and textures of the bundle beside it."""

import copy
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping

import numpy as np

from r2c2r_core.export.writers.text import numbers, quat_wxyz_of
from r2c2r_core.geometry.transforms import rotation_about_z, rotation_of
from r2c2r_core.variants.draw import Change, Variation

BASE, SURFACES = "../base", "../textures"  # relative to a variant's file
START = "start"  # the initial keyframe, with some joints ajar
_DRAWN = {"damping": "damping", "frictionloss": "friction", "armature": "armature"}


def varied(scene: ET.Element, variation: Variation, halves: Mapping[str, np.ndarray], links: Mapping[str, str]) -> ET.Element:
    """The document of one variant.

    `halves` maps objects to half their (width, depth, height) in m, `links` maps body names to objects.
    """
    root = copy.deepcopy(scene)
    changes = {change.name: change for change in variation.changes}
    compiler = root.find("compiler")
    assert compiler is not None
    compiler.set("meshdir", BASE)
    compiler.set("texturedir", BASE)
    bodies = {links.get(body.get("name", "")): body for body in _world(scene).findall("body")}
    for body in root.iter("body"):
        name = body.get("name", "")
        if name in links:
            change = changes[links[name]]
            half = halves[change.shape or change.name]
            if change.shape is not None:
                _take_shape(body, bodies[change.shape], float(half[2] - halves[change.name][2]))
            _vary_body(root, body, change, half, top=body in list(_world(root)))
    for joint in root.iter("joint"):
        if (drawn := variation.joints.get(joint.get("name", ""))) is not None:
            joint.set("range", numbers([0.0, drawn["upper"]]))
            for key, name in _DRAWN.items():
                joint.set(key, numbers(drawn[name]))
    _add_surfaces(root, changes.values())
    return root


def add_start(root: ET.Element, qpos: np.ndarray) -> None:
    """Add the variant's initial keyframe and remove the bundle's own, whose values no longer apply."""
    for old in root.findall("keyframe"):
        root.remove(old)
    keyframe = ET.SubElement(root, "keyframe")
    ET.SubElement(keyframe, "key", name=START, qpos=numbers(qpos))


def _vary_body(root: ET.Element, body: ET.Element, change: Change, half: np.ndarray, top: bool) -> None:
    scale = np.array(change.scale)
    if top:
        # the front and the underside are fixed: the origin is the box's centre
        moved = np.array([0.0, (scale[1] - 1) * half[1], (scale[2] - 1) * half[2]])
        position, quat = _numbers(body, "pos"), _numbers(body, "quat")
        rotation = rotation_of(quat)
        body.set("pos", numbers(position + rotation @ moved + [*change.shift_m, 0.0]))
        body.set("quat", numbers(quat_wxyz_of(rotation_about_z(change.turn_rad) @ rotation)))
    else:
        body.set("pos", numbers(_numbers(body, "pos") * scale))
    for inertial in body.findall("inertial"):
        _scale_inertial(inertial, scale, change.mass)
    for joint in body.findall("joint"):
        if joint.get("pos") is not None:
            joint.set("pos", numbers(_numbers(joint, "pos") * scale))
    for geom in body.findall("geom"):
        if geom.get("pos") is not None:
            geom.set("pos", numbers(_numbers(geom, "pos") * scale))
        if geom.get("type") == "box":
            geom.set("size", numbers(_numbers(geom, "size") * scale))
        if geom.get("type") == "mesh":
            _named(root, "mesh", geom.get("mesh")).set("scale", numbers(scale))
        if geom.get("class") == "collision" and change.friction is not None:
            geom.set("friction", numbers(change.friction))  # sliding; the others are those of the class
        if geom.get("material") is not None:
            _dress(root, geom, change)
        elif geom.get("class") == "visual" and geom.get("rgba") is not None:
            geom.set("rgba", numbers([*np.minimum(_numbers(geom, "rgba")[:3] * change.tint, 1.0), 1.0]))
    for site in body.findall("site"):
        if site.get("pos") is not None:
            site.set("pos", numbers(_numbers(site, "pos") * scale))
        if site.get("type") == "box":
            turn = rotation_of(_numbers(site, "quat"))  # a permutation of axes
            site.set("size", numbers(_numbers(site, "size") * (np.abs(turn.T) @ scale)))


def _take_shape(body: ET.Element, other: ET.Element, rise_m: float) -> None:
    """Replace a free body's shape and mass by another's; `rise_m` keeps its underside in place."""
    position = _numbers(body, "pos")
    body.set("pos", numbers([*position[:2], position[2] + rise_m]))
    for part in [part for part in body if part.tag != "freejoint"]:
        body.remove(part)
    for part in other:
        if part.tag != "freejoint":
            taken = copy.deepcopy(part)
            if taken.get("name") is not None:
                taken.set("name", taken.get("name", "").replace(other.get("name", ""), body.get("name", ""), 1))
            body.append(taken)


def _dress(root: ET.Element, geom: ET.Element, change: Change) -> None:
    """Tint the scan's texture, or replace it by a procedural one."""
    if change.texture is not None:
        geom.set("material", f"{change.name}_surface")
    else:
        _named(root, "material", geom.get("material")).set("rgba", numbers([*change.tint, 1.0]))


def _add_surfaces(root: ET.Element, changes: Iterable[Change]) -> None:
    asset = root.find("asset")
    assert asset is not None
    known: set[str] = set()
    for change in changes:
        if change.texture is None:
            continue
        if change.texture not in known:
            known.add(change.texture)
            file = f"{SURFACES}/{change.texture}.png"
            ET.SubElement(asset, "texture", name=f"surface_{change.texture}", type="cube", file=file)
        shape = {
            "texture": f"surface_{change.texture}",
            "rgba": numbers([*change.tint, 1.0]),
            "specular": "0.1",
            "shininess": "0.1",
        }
        ET.SubElement(asset, "material", {"name": f"{change.name}_surface", **shape})


def _named(root: ET.Element, tag: str, name: str | None) -> ET.Element:
    return next(found for found in root.iter(tag) if found.get("name") == name)


def _scale_inertial(inertial: ET.Element, scale: np.ndarray, mass: float) -> None:
    """Scale the mass by `mass`, and the second moments also by the squared scale of each axis."""
    inertial.set("pos", numbers(_numbers(inertial, "pos") * scale))
    inertial.set("mass", numbers(_numbers(inertial, "mass") * mass))
    xx, yy, zz, xy, xz, yz = _numbers(inertial, "fullinertia")
    full = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = 0.5 * np.trace(full) * np.eye(3) - full  # second moments of mass about the coordinate planes
    moments *= mass * np.outer(scale, scale)
    full = np.trace(moments) * np.eye(3) - moments
    inertial.set("fullinertia", numbers([full[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]))


def _world(root: ET.Element) -> ET.Element:
    world = root.find("worldbody")
    assert world is not None
    return world


def _numbers(element: ET.Element, key: str) -> np.ndarray:
    return np.array([float(value) for value in (element.get(key) or "0 0 0").split()])
