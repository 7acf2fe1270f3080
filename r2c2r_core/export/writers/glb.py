"""scene.glb: the scene for web viewers, closed, with joints as glTF animations: one clip per joint, and `open`.

One node per link with the link's name (glTF 2.0). glTF is +Y up: the root node rotates the world. It has no joints: type,
axis and limits are in the node's `extras`.
"""

import json
import struct
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path, PurePosixPath
from typing import Any

import cv2
import numpy as np

from r2c2r_core.export.assets import asset_file, assets_of
from r2c2r_core.export.labels import labels_of, labels_of_handle
from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.states import states_of
from r2c2r_core.export.writers.meshes import boxes_mesh
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.handle import Handle

Y_UP_FROM_WORLD = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
SECONDS = 3.0  # of a clip: closed, open in the middle, closed

_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT, _UNSIGNED = 5126, 5125  # component types, section 3.6.2.2
_PLAIN = {"metallicFactor": 0.0, "roughnessFactor": 0.9}


def write_glb(plan: Plan, path: Path) -> None:
    """Write the plan as one binary glTF with embedded textures, and each object's asset, which refers to texture files."""
    _write(plan, path, embedded=True)
    for asset in assets_of(plan):
        file = path.parent / asset_file(asset.name, ".glb")
        file.parent.mkdir(parents=True, exist_ok=True)
        _write(asset, file, embedded=False)


def _write(plan: Plan, path: Path, *, embedded: bool) -> None:
    gltf = _Gltf(path.parent if embedded else None)
    nodes = {WORLD: _node(WORLD, Rigid3(Y_UP_FROM_WORLD[:3, :3], np.zeros(3)))}
    materials: dict[str, int] = {}  # one per texture
    for body in plan.bodies:
        nodes[body.parent].setdefault("children", []).append(len(nodes))
        nodes[body.name] = _node(body.name, body.parent_from_body) | _mesh(body, gltf, materials)
        nodes[body.name]["extras"] = asdict(labels_of(body))
    for handle in plan.handles:
        nodes[handle.link].setdefault("children", []).append(len(nodes))
        nodes[handle.name] = _handle_node(handle, plan)
    clips = _clips(plan, gltf, nodes)
    document = {
        "asset": {"version": "2.0", "generator": "r2c2r"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": list(nodes.values()),
        "animations": clips,
        **gltf.tables,
        "buffers": [{"byteLength": len(gltf.binary)}],
    }
    path.write_bytes(_container({key: value for key, value in document.items() if value != []}, bytes(gltf.binary)))


def check_glb(path: Path) -> Iterator[str]:
    """Errors in the container: its header (glTF 2.0, section 4.4) gives magic, version and length."""
    content = path.read_bytes()
    if len(content) < 12 or content[:4] != b"glTF":
        yield "does not begin with 'glTF'"
        return
    version, length = struct.unpack("<II", content[4:12])
    if version != 2:
        yield f"is glTF {version}, expected 2"
    if length != len(content):
        yield f"holds {len(content)} bytes, expected {length}"


class _Gltf:
    """glTF tables and their single buffer; pictures of `folder` are embedded, or stay files if it is None."""

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        self.tables: dict[str, list[dict[str, Any]]] = {
            name: [] for name in ("meshes", "materials", "textures", "images", "accessors", "bufferViews")
        }
        self.binary = bytearray()

    def add(self, table: str, entry: dict[str, Any]) -> int:
        """Append an entry and return its number."""
        self.tables[table].append(entry)
        return len(self.tables[table]) - 1

    def picture(self, file: str) -> dict[str, Any]:
        """Image entry for a PNG, by file or embedded."""
        if self.folder is None:
            return {"uri": file}
        return {"mimeType": "image/png", "bufferView": self.view((self.folder / file).read_bytes())}

    def view(self, content: bytes) -> int:
        """Append an aligned buffer view and return its number."""
        start = len(self.binary)
        self.binary += content + b"\0" * (-len(content) % 4)
        return self.add("bufferViews", {"buffer": 0, "byteOffset": start, "byteLength": len(content)})

    def accessor(self, values: np.ndarray, kind: str, *, bounds: bool = False) -> int:
        """Append an accessor (32-bit floats, or indices) and return its number."""
        whole = values.dtype.kind in "iu"
        raw = np.ascontiguousarray(values, dtype="<u4" if whole else "<f4")
        entry: dict[str, Any] = {"componentType": _UNSIGNED if whole else _FLOAT, "count": len(raw), "type": kind}
        if bounds:
            ends = raw.reshape(len(raw), -1)
            entry |= {"min": ends.min(axis=0).tolist(), "max": ends.max(axis=0).tolist()}
        return self.add("accessors", entry | {"bufferView": self.view(raw.tobytes())})


def _node(name: str, parent_from_node: Rigid3) -> dict[str, Any]:
    translation, rotation = parent_from_node.translation.tolist(), _quat_xyzw(parent_from_node).tolist()
    return {"name": name, "translation": translation, "rotation": rotation}


def _handle_node(handle: Handle, plan: Plan) -> dict[str, Any]:
    """An empty node at a handle, +Z into the front and +X along the grip."""
    body = plan.body(handle.link)
    size = [round(float(value), 6) for value in handle.size_m]
    extras = asdict(labels_of_handle(handle, body)) | {"handle": handle.kind, "joint": handle.joint, "size_m": size}
    return {**_node(handle.name, body.world_from_body.inverse @ handle.world_from_handle), "extras": extras}


def _mesh(body: Body, gltf: _Gltf, materials: dict[str, int]) -> dict[str, int]:
    """The node's reference to the mesh of a body; empty for one without a shape."""
    visual, attributes = body.link.visual, dict[str, int]()
    if visual is not None and body.texture_file is not None:
        vertices, faces = visual.vertices, visual.faces
        attributes["TEXCOORD_0"] = gltf.accessor(visual.uv * (1, -1) + (0, 1), "VEC2")  # v runs down in glTF
        if body.texture_file not in materials:
            materials[body.texture_file] = _textured(gltf, body.texture_file)
        material = materials[body.texture_file]
    else:
        vertices, faces = boxes_mesh(body)
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(3 * len(faces))  # flat shading: unshared corners
        plain = {"baseColorFactor": [*map(float, body.link.colour), 1.0], **_PLAIN}
        material = gltf.add("materials", {"name": f"{body.name}_vis", "pbrMetallicRoughness": plain})
    if not len(faces):
        return {}
    attributes["POSITION"] = gltf.accessor(vertices, "VEC3", bounds=True)
    shape = {"attributes": attributes, "indices": gltf.accessor(faces.ravel(), "SCALAR"), "material": material}
    return {"mesh": gltf.add("meshes", {"name": f"{body.name}_vis", "primitives": [shape]})}


def _textured(gltf: _Gltf, file: str) -> int:
    """Append a material with a PNG texture and return its number."""
    name = PurePosixPath(file).stem
    image = gltf.add("images", {"name": name, **gltf.picture(file)})
    look = {"baseColorTexture": {"index": gltf.add("textures", {"source": image})}, **_PLAIN}
    return gltf.add("materials", {"name": name, "pbrMetallicRoughness": look, "doubleSided": True})


def _clips(plan: Plan, gltf: _Gltf, nodes: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """One clip of the joints that can be open at once, then one for each joint."""
    moving = [body for body in plan.bodies if body.joint is not None]
    if not moving:
        return []
    times = gltf.accessor(np.array([0.0, SECONDS / 2, SECONDS]), "SCALAR", bounds=True)
    clips = [_clip(body, gltf, times, nodes) for body in moving]
    at_once = [clip for clip in clips if clip["name"] in states_of(plan)["open"].joints]
    opened = {
        "name": "open",
        "samplers": [clip["samplers"][0] for clip in at_once],
        "channels": [clip["channels"][0] | {"sampler": number} for number, clip in enumerate(at_once)],
    }
    return [opened, *clips]


def _clip(body: Body, gltf: _Gltf, times: int, nodes: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """One joint's clip."""
    joint, axis, closed = body.joint, body.axis_body, body.parent_from_body
    assert joint is not None
    assert axis is not None
    limits = [joint.lower, joint.upper]
    nodes[body.name]["extras"] |= {"joint": body.joint_name, "type": joint.type, "axis": axis.tolist(), "range": limits}
    if joint.type == "revolute":
        opened = closed @ Rigid3(np.asarray(cv2.Rodrigues(axis * joint.upper)[0]), np.zeros(3))
        path, kind, ends = "rotation", "VEC4", (_quat_xyzw(closed), _quat_xyzw(opened))
    else:
        path, kind, ends = "translation", "VEC3", (closed.translation, closed.apply(axis[None] * joint.upper)[0])
    output = gltf.accessor(np.stack([ends[0], ends[1], ends[0]]), kind)
    return {
        "name": body.joint_name,
        "samplers": [{"input": times, "output": output, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": list(nodes).index(body.name), "path": path}}],
    }


def _quat_xyzw(pose: Rigid3) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(pose.rotation).as_quat(canonical=True))


def _container(document: dict[str, Any], binary: bytes) -> bytes:
    """The file: a header, the document, the buffer (glTF 2.0, section 4.4)."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", len(binary), _BIN) + binary
    return struct.pack("<III", _MAGIC, 2, 12 + len(chunks)) + chunks
