"""A variation as MJCF: scene.xml with changed values, sharing the meshes and textures of the bundle beside it."""

import copy
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping

import numpy as np

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
            joint.set("range", _text([0.0, drawn["upper"]]))
            for key, name in _DRAWN.items():
                joint.set(key, _text(drawn[name]))
    _add_surfaces(root, changes.values())
    return root


def add_start(root: ET.Element, qpos: np.ndarray) -> None:
    """Add the variant's initial keyframe and remove the bundle's own, whose values no longer apply."""
    for old in root.findall("keyframe"):
        root.remove(old)
    keyframe = ET.SubElement(root, "keyframe")
    ET.SubElement(keyframe, "key", name=START, qpos=_text(qpos))


def _vary_body(root: ET.Element, body: ET.Element, change: Change, half: np.ndarray, top: bool) -> None:
    scale = np.array(change.scale)
    if top:
        # the front and the underside are fixed: the origin is the box's centre
        moved = np.array([0.0, (scale[1] - 1) * half[1], (scale[2] - 1) * half[2]])
        position, quat = _numbers(body, "pos"), _numbers(body, "quat")
        turned = _turned(quat, change.turn_rad)
        body.set("pos", _text(position + _matrix(quat) @ moved + [*change.shift_m, 0.0]))
        body.set("quat", _text(turned))
    else:
        body.set("pos", _text(_numbers(body, "pos") * scale))
    for inertial in body.findall("inertial"):
        _scale_inertial(inertial, scale, change.mass)
    for joint in body.findall("joint"):
        if joint.get("pos") is not None:
            joint.set("pos", _text(_numbers(joint, "pos") * scale))
    for geom in body.findall("geom"):
        if geom.get("pos") is not None:
            geom.set("pos", _text(_numbers(geom, "pos") * scale))
        if geom.get("type") == "box":
            geom.set("size", _text(_numbers(geom, "size") * scale))
        if geom.get("type") == "mesh":
            _scale_mesh(root, geom.get("mesh", ""), scale)
        if geom.get("class") == "collision" and change.friction is not None:
            geom.set("friction", _text(change.friction))  # sliding; the others are those of the class
        if geom.get("material") is not None:
            _dress(root, geom, change)
        elif geom.get("class") == "visual" and geom.get("rgba") is not None:
            geom.set("rgba", _text([*np.minimum(_numbers(geom, "rgba")[:3] * change.tint, 1.0), 1.0]))
    for site in body.findall("site"):
        if site.get("pos") is not None:
            site.set("pos", _text(_numbers(site, "pos") * scale))
        if site.get("type") == "box":
            turn = _matrix(_numbers(site, "quat"))  # a permutation of axes
            site.set("size", _text(_numbers(site, "size") * (np.abs(turn.T) @ scale)))


def _take_shape(body: ET.Element, other: ET.Element, rise_m: float) -> None:
    """Replace a free body's shape and mass by another's; `rise_m` keeps its underside in place."""
    position = _numbers(body, "pos")
    body.set("pos", _text([*position[:2], position[2] + rise_m]))
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
        material = next(found for found in root.iter("material") if found.get("name") == geom.get("material"))
        material.set("rgba", _text([*change.tint, 1.0]))


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
            "rgba": _text([*change.tint, 1.0]),
            "specular": "0.1",
            "shininess": "0.1",
        }
        ET.SubElement(asset, "material", {"name": f"{change.name}_surface", **shape})


def _scale_mesh(root: ET.Element, name: str, scale: np.ndarray) -> None:
    mesh = next(found for found in root.iter("mesh") if found.get("name") == name)
    mesh.set("scale", _text(scale))


def _scale_inertial(inertial: ET.Element, scale: np.ndarray, mass: float) -> None:
    """Scale the mass by `mass`, and the second moments also by the squared scale of each axis."""
    inertial.set("pos", _text(_numbers(inertial, "pos") * scale))
    inertial.set("mass", _text(_numbers(inertial, "mass") * mass))
    xx, yy, zz, xy, xz, yz = _numbers(inertial, "fullinertia")
    full = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = 0.5 * np.trace(full) * np.eye(3) - full  # second moments of mass about the coordinate planes
    moments *= mass * np.outer(scale, scale)
    full = np.trace(moments) * np.eye(3) - moments
    inertial.set("fullinertia", _text([full[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]))


def _world(root: ET.Element) -> ET.Element:
    world = root.find("worldbody")
    assert world is not None
    return world


def _numbers(element: ET.Element, key: str) -> np.ndarray:
    return np.array([float(value) for value in (element.get(key) or "0 0 0").split()])


def _text(values: object) -> str:
    return " ".join(f"{float(value):.9g}" for value in np.asarray(values, dtype=np.float64).ravel())


def _turned(quat_wxyz: np.ndarray, angle: float) -> np.ndarray:
    """The rotation followed by a turn about the world's z axis."""
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    w, x, y, z = quat_wxyz
    return np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])


def _matrix(quat_wxyz: np.ndarray) -> np.ndarray:
    w, x, y, z = quat_wxyz
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
