"""Checks that assets, scene.sdf and the ROS package refer only to files of the bundle, and that assets' joints match."""

import json
import math
import posixpath
import re
import struct
import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any, TypeAlias

from r2c2r_core.errors import BundleError
from r2c2r_core.export.reading import MOVING, Urdf, UrdfJoint, read_urdf
from r2c2r_core.export.rules.files import BundleFiles, is_inside
from r2c2r_core.export.rules.table import finding
from r2c2r_core.model.report import Finding
from r2c2r_core.schema.manifest import Manifest

_Told: TypeAlias = tuple[str, float, float]  # a joint's type and limits

USD_REFERENCE = re.compile(r"@@@(.+?)@@@|@([^@\n]+)@")
_PACKAGE = re.compile(r"package://[a-z0-9_]+/")


def check_assets(urdf: Urdf, files: BundleFiles) -> Iterator[Finding]:
    """Findings on assets; none for older bundles without these files (in newer ones, checksums detect removed files)."""
    objects = _objects(files)
    meshes = {shape.mesh for link in urdf.links for shape in link.shapes if shape.mesh is not None}
    meshes |= {name for item in objects for names in item["meshes"].values() for name in names}
    for path in (*sorted((files.folder / "assets").glob("*/*")), files.folder / "scene.sdf", files.folder / "ros/scene.urdf"):
        if not path.is_file():
            continue
        name = path.relative_to(files.folder).as_posix()
        try:
            yield from _paths(name, _references(path), files, meshes)
            if path.suffix == ".urdf" and name.startswith("assets/"):
                yield from _same_joints(name, path, urdf, objects)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, ET.ParseError, struct.error, BundleError) as error:
            yield finding("asset-unreadable", name, f"{type(error).__name__}: {error}".partition("\n")[0])


def _references(path: Path) -> list[str]:
    """References in a file, as written; empty for other file types."""
    if path.suffix == ".usda":
        return [triple or single for triple, single in USD_REFERENCE.findall(path.read_text(errors="replace"))]
    if path.suffix == ".glb":
        return [entry["uri"] for key in ("images", "buffers") for entry in _gltf(path).get(key, []) if "uri" in entry]
    if path.suffix in (".urdf", ".xml", ".sdf"):
        root = ET.fromstring(path.read_bytes())
        said = [v for e in root.iter() for k, v in e.attrib.items() if k.startswith("file") or k.endswith("dir")]
        return [*said, *((e.text or "").strip() for e in root.iter("uri"))]
    return []


def _paths(name: str, references: Iterable[str], files: BundleFiles, meshes: Collection[str]) -> Iterator[Finding]:
    """Findings on references that are not bundle files relative to the referring file; the scene's `meshes` have own rules."""
    for reference in references:
        plain = "" if name.startswith("ros/") else posixpath.dirname(name)
        said = _PACKAGE.sub("", reference, count=1) if name.startswith("ros/") else reference
        path = posixpath.normpath(posixpath.join(plain, said))
        if not is_inside(path) or files.path(path) is None:
            yield finding("asset-path", name, f"reads '{reference}'")
        elif not (files.folder / path).is_file() and str(PurePosixPath(path).with_suffix(".obj")) not in meshes:
            yield finding("asset-missing", name, f"reads '{reference}', which does not exist")


def _same_joints(name: str, path: Path, urdf: Urdf, objects: list[dict[str, Any]]) -> Iterator[Finding]:
    """Findings on an asset's joints that match neither scene.urdf nor the manifest (their difference has its own rule)."""
    said = {joint["name"]: (joint["type"], joint["lower"], joint["upper"]) for item in objects for joint in item["joints"]}
    scene = {joint.name: _told(joint) for joint in urdf.joints}
    for joint in read_urdf(path).joints:
        if joint.type in MOVING and not any(_alike(_told(joint), known.get(joint.name)) for known in (scene, said)):
            yield finding("asset-differs", name, f"its joint {joint.name} is not the scene's")


def _told(joint: UrdfJoint) -> _Told:
    limit = joint.limit or {}
    return joint.type, limit.get("lower", math.nan), limit.get("upper", math.nan)


def _alike(one: _Told, other: _Told | None) -> bool:
    return other is not None and one[0] == other[0] and all(abs(a - b) < 1e-5 for a, b in zip(one[1:], other[1:], strict=True))


def _objects(files: BundleFiles) -> list[dict[str, Any]]:
    """Objects of the manifest; empty if it breaks its schema, which has its own rule."""
    try:
        document = json.loads((files.folder / "manifest.json").read_bytes())
        return [item.model_dump() for item in Manifest.model_validate(document).objects]
    except (OSError, ValueError, RecursionError):
        return []


def _gltf(path: Path) -> dict[str, list[dict[str, str]]]:
    content = path.read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    document: dict[str, list[dict[str, str]]] = json.loads(content[20 : 20 + length])
    return document
