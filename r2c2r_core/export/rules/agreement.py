"""Consistency of the manifest and scene.xml with scene.urdf."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator

import numpy as np

from r2c2r_core.documents import parse_json
from r2c2r_core.errors import BundleError
from r2c2r_core.export.plan import WORLD
from r2c2r_core.export.reading import MOVING, Urdf, UrdfJoint
from r2c2r_core.export.rules.assets import USD_REFERENCE
from r2c2r_core.export.rules.files import BundleFiles, is_inside
from r2c2r_core.export.rules.table import finding
from r2c2r_core.export.writers.table import FORMATS, formats
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.report import Finding
from r2c2r_core.schema.document import checked
from r2c2r_core.schema.manifest import Manifest, ManifestJoint, ManifestObject

REQUIRED_FILES = (*(entry.file for entry in FORMATS if entry.required), "manifest.json", "preview.png", "README.txt")
SUPPORT_SUFFIX = "_support"
"""Links of this ending hold a free-standing thing up; they belong to no object."""


def check_agreement(urdf: Urdf, files: BundleFiles) -> Iterator[Finding]:
    """Check required files, manifest and scene.xml against the URDF, and scene.usda's references (its loader does the rest)."""
    for name in REQUIRED_FILES:
        if not (files.folder / name).is_file():
            yield finding("file-missing", name, "it is not in the bundle")
    yield from _own_checks(files)
    manifest = files.folder / "manifest.json"
    if manifest.is_file():
        yield from _manifest(urdf, manifest.read_bytes())
    scene = files.folder / "scene.xml"
    if scene.is_file():
        yield from _mjcf(urdf, scene.read_bytes())
    layer = files.folder / "scene.usda"
    if layer.is_file():
        yield from _usd(layer.read_bytes())


def _own_checks(files: BundleFiles) -> Iterator[Finding]:
    """Findings of each format's own check; formats added by other packages need not be in every bundle."""
    for entry in formats():
        path = files.folder / entry.file
        if entry.check is None or not path.is_file():
            continue
        try:
            lines = list(entry.check(path))
        except Exception as error:  # a format of another package may raise anything on a file that is damaged
            lines = [f"cannot be checked: {type(error).__name__}: {error}"]
        yield from (finding("format", entry.file, line) for line in lines)


def _usd(content: bytes) -> Iterator[Finding]:
    if not content.startswith(b"#usda 1."):
        yield finding("usd-parse", "scene.usda", "does not begin with '#usda 1.'")
    for triple, single in USD_REFERENCE.findall(content.decode(errors="replace")):
        if not is_inside((triple or single).removeprefix("./")):
            yield finding("usd-path", "scene.usda", f"reads '{triple or single}'")


def _manifest(urdf: Urdf, content: bytes) -> Iterator[Finding]:
    try:
        document = parse_json(content, "manifest.json", BundleError, hint="")
        manifest = checked(Manifest, document, "manifest.json", BundleError, hint="")
    except BundleError as error:
        yield finding("manifest-schema", "manifest.json", str(error).removeprefix("manifest.json: "))
        return
    yield from _objects(urdf, manifest.objects)


def _objects(urdf: Urdf, objects: list[ManifestObject]) -> Iterator[Finding]:
    poses = urdf.world_poses()
    joints = {joint.name: joint for joint in urdf.joints}
    claimed: set[str] = set()
    for item in objects:
        links = _links_of(item.name, urdf, [other.name for other in objects])
        if not links:
            yield finding("manifest-object", item.name, "no link of the URDF starts with this name")
            continue
        claimed |= links
        for entry in item.joints:
            yield from _joint(entry, joints.get(entry.name), poses)
        listed = {entry.name for entry in item.joints}
        unlisted = {j.name for j in urdf.joints if j.child in links and j.type in MOVING} - listed
        if unlisted:
            yield finding("manifest-joint", item.name, f"joints not in the manifest: {', '.join(sorted(unlisted))}")
        yield from _meshes_and_mass(item, links, urdf)
    orphans = {x.name for x in urdf.links} - claimed - {WORLD}
    orphans = {name for name in orphans if not name.endswith(SUPPORT_SUFFIX)}
    if orphans:
        yield finding("manifest-object", sorted(orphans)[0], f"{len(orphans)} links belong to no object of the manifest")


def _links_of(name: str, urdf: Urdf, names: list[str]) -> set[str]:
    """Links that start with the object's name and with no longer object's name; supports belong to no object."""
    longer = [other for other in names if other != name and other.startswith(f"{name}_")]
    return {
        link.name
        for link in urdf.links
        if (link.name == name or link.name.startswith(f"{name}_"))
        and not any(link.name.startswith(f"{other}_") or link.name == other for other in longer)
        and not link.name.endswith(SUPPORT_SUFFIX)
    }


def _joint(entry: ManifestJoint, joint: UrdfJoint | None, poses: dict[str, Rigid3]) -> Iterator[Finding]:
    where = entry.name
    if joint is None:
        yield finding("manifest-joint", where, "the URDF has no such joint")
        return
    if joint.type != entry.type:
        yield finding("manifest-joint", where, f"type {entry.type}, the URDF says {joint.type}")
    for key, said in (("lower", entry.lower), ("upper", entry.upper)):
        there = (joint.limit or {}).get(key, np.nan)
        if not abs(there - said) < 1e-5:
            yield finding("manifest-joint", where, f"{key} {said}, the URDF says {there:.6g}")
    pose = poses.get(joint.child)
    if pose is None:
        return
    axis = np.asarray(entry.axis, dtype=np.float64)
    turned = pose.turn(joint.axis)
    if not float(np.linalg.norm(axis - turned)) < 1e-3:
        yield finding("manifest-joint", where, f"its axis differs from the URDF's by {np.linalg.norm(axis - turned):.3g}")
    offset = np.asarray(entry.origin, dtype=np.float64) - pose.translation
    off_line = float(np.linalg.norm(offset - (offset @ turned) * turned))
    if joint.type == "revolute" and not off_line < 1e-4:
        yield finding("manifest-joint", where, f"its hinge line is {1000 * off_line:.1f} mm from the URDF's")


def _meshes_and_mass(item: ManifestObject, links: set[str], urdf: Urdf) -> Iterator[Finding]:
    own = [link for link in urdf.links if link.name in links]
    for kind, listed in (("visual", item.meshes.visual), ("collision", item.meshes.collision)):
        there = {shape.mesh for link in own for shape in link.shapes if shape.kind == kind and shape.mesh is not None}
        if there != set(listed):
            differing = sorted(there ^ set(listed))
            yield finding("manifest-mesh", item.name, f"{kind} meshes differ: {', '.join(differing)}")
    mass = sum(link.inertial.mass_kg for link in own if link.inertial is not None)
    if not abs(mass - item.mass_kg) <= 1e-4 * max(mass, 0.1):
        yield finding("manifest-mass", item.name, f"{item.mass_kg} kg, the URDF's links weigh {mass:.6g} kg")


def _mjcf(urdf: Urdf, content: bytes) -> Iterator[Finding]:
    try:
        root = ET.fromstring(content)
    except (ET.ParseError, ValueError) as error:
        yield finding("mjcf-parse", "scene.xml", f"not XML: {error}")
        return
    if root.tag != "mujoco":
        yield finding("mjcf-parse", "scene.xml", f"holds <{root.tag}>, not <mujoco>")
        return
    for element in root.iter():
        files = [value for key, value in element.attrib.items() if key.startswith("file") or key.endswith("dir")]
        unsafe = [value for value in files if value and not is_inside(value)]
        if unsafe or element.tag == "include":
            yield finding("mjcf-path", "scene.xml", f"<{element.tag}> reads '{(unsafe or files or ['?'])[0]}'")
    yield from _mjcf_joints(urdf, root)
    yield from _mjcf_masses(urdf, root)


def _mjcf_joints(urdf: Urdf, root: ET.Element) -> Iterator[Finding]:
    there = {element.get("name"): element for element in root.iter("joint") if element.get("range") is not None}
    expected = {joint.name: joint for joint in urdf.joints if joint.type in ("revolute", "prismatic")}
    for name in sorted(set(expected) ^ {str(key) for key in there}):
        missing = "scene.xml" if name in expected else "scene.urdf"
        yield finding("mjcf-joint", name, f"{missing} has no such joint")
    for name, joint in expected.items():
        element = there.get(name)
        if element is None:
            continue
        kind = {"revolute": "hinge", "prismatic": "slide"}[joint.type]
        if element.get("type", "hinge") != kind:
            yield finding("mjcf-joint", name, f"scene.xml says {element.get('type', 'hinge')}, expected {kind}")
        span = [_number(word) for word in element.get("range", "").split()]
        limits = joint.limit or {}
        if len(span) != 2 or not np.allclose(span, [limits.get("lower", np.nan), limits.get("upper", np.nan)], atol=1e-5):
            yield finding("mjcf-joint", name, f"scene.xml has the range {element.get('range')}, not the URDF's")


def _mjcf_masses(urdf: Urdf, root: ET.Element) -> Iterator[Finding]:
    there = {}
    for body in root.iter("body"):
        inertial = body.find("inertial")
        there[body.get("name")] = _number(inertial.get("mass", "")) if inertial is not None else float("nan")
    for link in urdf.links:
        if link.inertial is not None and link.name != WORLD:
            mass = there.get(link.name, float("nan"))
            if not abs(mass - link.inertial.mass_kg) <= 1e-5 * max(abs(mass), 1e-3):
                yield finding("mjcf-mass", link.name, f"scene.xml says {mass:.6g} kg, the URDF {link.inertial.mass_kg:.6g} kg")


def _number(text: str) -> float:
    """The number; NaN, which equals nothing, for invalid text."""
    try:
        return float(text)
    except ValueError:
        return float("nan")
