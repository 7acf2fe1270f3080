"""Table of all rules (linter, simulation, likeness, hands, checksums): name, severity, and the failure it prevents."""

from typing import Literal, NamedTuple

from r2c2r_core.model.report import Finding


class Rule(NamedTuple):
    """One row of the table."""

    severity: Literal["error", "warning"]
    protects: str


RULES: dict[str, Rule] = {
    "number": Rule("error", "a number that is missing, not finite or not a number"),
    "name": Rule("error", "names outside [A-Za-z0-9_]: loaders and ROS refuse or rewrite them"),
    "format": Rule("error", "what a format's own check finds in its file"),
    "duplicate-link": Rule("error", "MuJoCo, PyBullet and SAPIEN refuse it"),
    "duplicate-joint": Rule("error", "MuJoCo, PyBullet and SAPIEN refuse it"),
    "root": Rule("error", "two roots: SAPIEN refuses, MuJoCo loses the loose link"),
    "tree": Rule("error", "a joint to a link that is not there, or a link with two parents"),
    "joint-type": Rule("error", "floating and planar joints mean something else in every loader"),
    "mujoco-block": Rule("error", "without it MuJoCo drops visuals and static masses, 3.x also mesh paths"),
    "limit-missing": Rule("error", "PyBullet and SAPIEN refuse a joint without <limit>; MuJoCo opens it without end"),
    "limit-incomplete": Rule("error", "lower, upper, effort and velocity are all needed"),
    "limit-order": Rule("error", "lower above upper disables the limit in MuJoCo and inverts it in SAPIEN"),
    "limit-zero": Rule("error", "a closed pose outside the limits jumps on the first step"),
    "limit-effort": Rule("warning", "efforts in the hundreds make the limit meaningless for furniture"),
    "axis-unit": Rule("error", "a joint axis must have length one"),
    "dynamics-missing": Rule("warning", "without damping and friction doors drift and slam"),
    "inertial-missing": Rule("error", "loaders invent a mass: 1 kg or 1000 kg/m3"),
    "mass-positive": Rule("error", "a mass of zero or less: MuJoCo refuses, PyBullet fixes it in place"),
    "inertia-positive": Rule("error", "an inertia that is not positive definite"),
    "inertia-triangle": Rule("error", "A + B < C: no body has such an inertia, MuJoCo refuses"),
    "inertia-impossible": Rule("error", "more inertia than all the mass at the farthest point of the link"),
    "com-outside": Rule("warning", "the centre of mass lies outside the link"),
    "mesh-path": Rule("error", "package://, absolute paths and paths out of the bundle fail elsewhere"),
    "mesh-spaces": Rule("error", "spaces in a path break MTL and ROS"),
    "mesh-missing": Rule("error", "some loaders drop it silently"),
    "mesh-format": Rule("error", "MuJoCo, PyBullet and the USD converter read OBJ and STL only"),
    "mesh-scale": Rule("error", "scale belongs into the mesh; a negative one turns it inside out"),
    "mesh-basename": Rule("error", "MuJoCo 3.x silently reuses the first mesh of that name"),
    "mesh-unreadable": Rule("error", "an empty or damaged mesh"),
    "mesh-size": Rule("warning", "millimetres or inches instead of metres"),
    "texture-missing": Rule("error", "the material or its picture is not in the bundle"),
    "collider-missing": Rule("error", "a moving link without a collider"),
    "collision-flat": Rule("error", "a flat collision mesh: MuJoCo refuses it as coplanar"),
    "collision-concave": Rule("error", "every engine fills it to its convex hull"),
    "collision-parts": Rule("error", "several parts in one OBJ: open in PyBullet, a solid hull elsewhere"),
    "collision-vertices": Rule("warning", "engines on GPUs bound a hull's vertices, or slow down"),
    "collision-coplanar": Rule("warning", "a face of many vertices: contacts on it take long in MJX and Brax"),
    "box-size": Rule("error", "a box without extent"),
    "file-missing": Rule("error", "a file every bundle has"),
    "manifest-schema": Rule("error", "the manifest cannot be read by its schema"),
    "manifest-object": Rule("error", "objects of the manifest and links of the URDF do not pair up"),
    "manifest-joint": Rule("error", "a joint differs between manifest and URDF"),
    "manifest-mesh": Rule("error", "meshes of the manifest and of the URDF differ"),
    "manifest-mass": Rule("error", "masses of the manifest and of the URDF differ"),
    "mjcf-parse": Rule("error", "scene.xml is not MJCF"),
    "mjcf-path": Rule("error", "scene.xml reads files from outside the bundle"),
    "mjcf-joint": Rule("error", "joints of scene.xml and of the URDF differ"),
    "mjcf-mass": Rule("error", "masses of scene.xml and of the URDF differ"),
    "usd-parse": Rule("error", "scene.usda is not USD text"),
    "usd-path": Rule("error", "scene.usda reads files from outside the bundle"),
    "asset-path": Rule("error", "an asset, scene.sdf or the ROS package reads files from outside the bundle"),
    "asset-missing": Rule("error", "a file that an asset, scene.sdf or the ROS package reads is not in the bundle"),
    "asset-unreadable": Rule("error", "an asset that is damaged"),
    "asset-differs": Rule("error", "a joint of an asset is not the scene's"),
}

SIMULATION_RULES: dict[str, Rule] = {
    "mjcf-compile": Rule("error", "MuJoCo cannot compile scene.xml, so nothing could be simulated"),
    "penetration-rest": Rule("error", "bodies overlap while everything is closed: they fly apart or stick"),
    "penetration-sweep": Rule("error", "a joint moves its part into a collision"),
    "cavity": Rule("error", "a door or a tray of solid colliders: nothing fits in"),
    "opening": Rule("warning", "a mug or a bowl whose colliders fill its cavity: nothing can be put into it"),
    "collider-far": Rule("warning", "the visible surface and the colliders differ"),
    "together": Rule("warning", "parts of two joints meet when both are open, as in many real kitchens"),
    "travel": Rule("error", "a joint jams under a hand's force"),
    "hover": Rule("error", "a free object touches nothing and falls when the simulation starts"),
    "drift": Rule("error", "an untouched object falls or creeps"),
    "unstable": Rule("error", "the simulation diverges"),
    "overlap": Rule("warning", "fixed parts of two objects overlap"),
    "untested": Rule("error", "a simulation test that could not be run"),
    "blocked-by": Rule("warning", "a free-standing object blocks a joint"),
}

LIKENESS_RULES: dict[str, Rule] = {
    "same-thing": Rule("error", "one thing built twice, each in the other's place"),
    "masks-overlap": Rule("warning", "two objects, each with a part of the other"),
    "click-disobeyed": Rule("warning", "a mask that is not what a person clicked"),
    "size-unlikely": Rule("warning", "two doors built as one, or a part of one as a whole"),
    "in-the-air": Rule("warning", "the upper part of what stands on the floor, built as a whole"),
    "in-a-wall": Rule("warning", "a drawer that slides out of a bare wall"),
    "edge-unsure": Rule("warning", "a front that ends where no edge shows, or holds a seam"),
    "place-unsure": Rule("warning", "an object with the wrong orientation or position"),
    "hinge-unsure": Rule("warning", "a door hinged on the wrong side"),
    "travel-cut": Rule(
        "warning", "a joint that opens less than half of the usual range of its kind: something is in the wrong place"
    ),
}

HAND_RULES: dict[str, Rule] = {
    "handle-reach": Rule("warning", "a handle that a gripper 9 cm wide cannot grasp"),
}

SEAL_RULES: dict[str, Rule] = {
    "file-changed": Rule("error", "a file that differs from the certified one"),
    "file-lost": Rule("error", "a missing file of the bundle"),
    "file-unlisted": Rule("warning", "a file that was not certified"),
    "file-unsealed": Rule("warning", "a bundle without checksums: changes in it cannot be detected"),
}

UNSAFE = ("mesh-path", "mjcf-path", "usd-path", "asset-path")
"""With one of these, no loader is given the bundle: it would read files of this machine."""


EVERY_RULE = RULES | SIMULATION_RULES | LIKENESS_RULES | HAND_RULES | SEAL_RULES


def finding(rule: str, where: str, message: str) -> Finding:
    """A finding of a rule in any table."""
    return Finding(rule=rule, severity=EVERY_RULE[rule].severity, where=where, message=message)
