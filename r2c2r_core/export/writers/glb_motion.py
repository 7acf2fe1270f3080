"""The joints of a GLB as glTF animations: one clip a joint, and `all`, each opening and closing again.

trimesh writes no animation, so the file is taken apart and put together again (glTF 2.0, chapters 3.11 and 4.4). glTF has no
word for a joint; type, axis and limits stand in the node's `extras`.
"""

import json
import struct
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from r2c2r_core.export.plan import Body
from r2c2r_core.geometry.transforms import Rigid3

SECONDS = 3.0  # of a clip: closed, open in the middle, closed

_JSON, _BIN = 0x4E4F534A, 0x004E4942
_FLOAT = 5126


def with_motion(glb: bytes, bodies: Sequence[Body]) -> bytes:
    """The GLB with every joint of the bodies as a clip; nodes are found by the bodies' names."""
    document, binary = _taken_apart(glb)
    moving = [body for body in bodies if body.joint is not None]
    if not moving:
        return glb
    pack = _Pack(document, binary)
    times = pack.accessor(np.array([0.0, SECONDS / 2, SECONDS]), "SCALAR", bounds=True)
    clips = {body.joint_name: _clip(body, document, pack, times) for body in moving}
    everything: dict[str, Any] = {"name": "all", "channels": [], "samplers": []}
    for number, clip in enumerate(clips.values()):
        everything["samplers"] += clip["samplers"]
        everything["channels"] += [{**channel, "sampler": number} for channel in clip["channels"]]
    document["animations"] = [everything, *clips.values()]
    document["buffers"][0]["byteLength"] = len(pack.binary)
    return _put_together(document, bytes(pack.binary))


class _Pack:
    """Appends arrays to a GLB's one buffer."""

    def __init__(self, document: dict[str, Any], binary: bytes) -> None:
        self.document, self.binary = document, bytearray(binary)

    def accessor(self, values: np.ndarray, kind: str, *, bounds: bool = False) -> int:
        """Number of a new accessor of 32-bit floats."""
        raw = np.ascontiguousarray(values, dtype="<f4")
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": raw.nbytes}
        self.binary += raw.tobytes()
        self.document["bufferViews"].append(view)
        entry: dict[str, Any] = {
            "bufferView": len(self.document["bufferViews"]) - 1,
            "componentType": _FLOAT,
            "count": len(raw),
            "type": kind,
        }
        if bounds:
            entry |= {"min": [float(raw.min())], "max": [float(raw.max())]}
        self.document["accessors"].append(entry)
        return len(self.document["accessors"]) - 1


def _clip(body: Body, document: dict[str, Any], pack: _Pack, times: int) -> dict[str, Any]:
    """One joint's clip; its node gets a translation and a rotation in place of its matrix, as animated nodes must."""
    joint, axis = body.joint, body.axis_body
    assert joint is not None
    assert axis is not None
    number = next(k for k, node in enumerate(document["nodes"]) if node.get("name") == body.name)
    node = document["nodes"][number]
    node.pop("matrix", None)
    closed = body.parent_from_body
    node |= {"translation": closed.translation.tolist(), "rotation": _quat_xyzw(closed).tolist()}
    node["extras"] = {"joint": body.joint_name, "type": joint.type, "axis": axis.tolist(), "range": [joint.lower, joint.upper]}
    if joint.type == "revolute":
        opened = closed @ Rigid3(np.asarray(cv2.Rodrigues(axis * joint.upper)[0]), np.zeros(3))
        path, kind, ends = "rotation", "VEC4", (_quat_xyzw(closed), _quat_xyzw(opened))
    else:
        path, kind, ends = "translation", "VEC3", (closed.translation, closed.apply(axis[None] * joint.upper)[0])
    output = pack.accessor(np.stack([ends[0], ends[1], ends[0]]), kind)
    return {
        "name": body.joint_name,
        "samplers": [{"input": times, "output": output, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": number, "path": path}}],
    }


def _quat_xyzw(pose: Rigid3) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(pose.rotation).as_quat(canonical=True))


def _taken_apart(glb: bytes) -> tuple[dict[str, Any], bytes]:
    length, _ = struct.unpack_from("<II", glb, 12)
    document: dict[str, Any] = json.loads(glb[20 : 20 + length])
    binary_length, _ = struct.unpack_from("<II", glb, 20 + length)
    return document, glb[28 + length : 28 + length + binary_length]


def _put_together(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", len(binary), _BIN) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks
