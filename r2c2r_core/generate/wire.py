"""Request format of a remote mesh generator: multipart/form-data with the object's good frames.

POST /v1/mesh carries these parts:

| part    | how often      | content |
|---------|----------------|---------|
| params  | once           | JSON, below |
| image   | once a view    | PNG RGBA, the frame cropped to the object; alpha 255 is the object's mask |
| depth   | once a view    | .npy float32 (h, w), z-depth in metres at the sensor's own resolution, 0 unknown |
| context | once           | a noun file (codec.py) with the object's measures and the room: for our own generators |

params: {"version": 1, "object": name, "category": text, "candidate": id, "seed": int, "views": [{"frame": int,
"rgb_camera": camera, "depth_camera": camera, "world_from_camera": 4x4 rows, "sharpness": 0..1, "cropped": bool,
"depth_noise": {"floor_m", "per_m"}}]}; the n-th view is of the n-th image and depth; the depth's standard
deviation is floor_m + per_m * z; camera: {"fx", "fy", "cx", "cy", "width", "height"} in pixels of that picture, pixel
centres at i + 0.5; camera axes as OpenCV (+X right, +Y down, +Z forward), world metres with +Z up. A server that knows
only pictures reads `image` and `seed` and leaves the rest.
"""

import io
import json
import secrets
from dataclasses import asdict, replace
from typing import Any, NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.codec import decode_noun, encode_noun
from r2c2r_core.errors import InputError
from r2c2r_core.generate.cutout import bounded, png_of
from r2c2r_core.generate.evidence import Evidence, View
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Capture, Depth, Room, SceneSurface
from r2c2r_core.model.track import MaskTrack

VERSION = 1


class Wish(NamedTuple):
    """A request for one candidate."""

    evidence: Evidence
    candidate_id: str
    seed: int


def encode_wish(wish: Wish) -> tuple[str, bytes]:
    """Content type and body of a request."""
    evidence = wish.evidence
    views = [bounded(view) for view in evidence.pool]
    params = {
        "version": VERSION,
        "object": evidence.track.name,
        "category": evidence.track.category,
        "candidate": wish.candidate_id,
        "seed": wish.seed,
        "views": [_view_entry(view) for view in views],
    }
    context = encode_noun((replace(evidence.track, masks={}, confidence={}), evidence.capture.room), {})
    parts = [("params", "application/json", json.dumps(params).encode())]
    for view in views:
        parts.append(("image", "image/png", png_of(np.dstack([view.rgb, view.mask.astype(np.uint8) * 255]))))
        parts.append(("depth", "application/octet-stream", _npy(view.depth_m)))
    parts.append(("context", "application/zip", context))
    return encode_form(parts)


def decode_wish(content_type: str, body: bytes) -> Wish:
    """The request that `encode_wish` wrote; raises InputError naming the missing or invalid part."""
    form = decode_form(content_type, body)
    try:
        params = json.loads(form["params"][0])
        if params["version"] != VERSION:
            raise InputError(f"params.version is {params['version']}, {VERSION} expected")
        views = tuple(
            _view(entry, png, depth) for entry, png, depth in zip(params["views"], form["image"], form["depth"], strict=True)
        )
        (track, room), _ = decode_noun(form["context"][0])
        candidate, seed = str(params["candidate"]), int(params["seed"])
    except InputError:
        raise
    except Exception as error:  # bytes from the network: the decoders raise arbitrary exceptions on a corrupt part
        raise InputError(f"the request cannot be read: {type(error).__name__}: {error}") from error
    if not isinstance(track, MaskTrack) or not isinstance(room, Room) or not views:
        raise InputError("the request cannot be read: a track, a room and at least one view expected")
    return Wish(Evidence(capture=_capture_of(room), track=track, pool=views), candidate, seed)


def encode_form(parts: list[tuple[str, str, bytes]]) -> tuple[str, bytes]:
    """Content type and body of a multipart form; each part is (name, content type, content)."""
    boundary = secrets.token_hex(24)
    lines: list[bytes] = []
    for name, kind, content in parts:
        head = (
            f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"; filename="{name}"\r\nContent-Type: {kind}\r\n\r\n'
        )
        lines += [head.encode(), content, b"\r\n"]
    lines.append(f"--{boundary}--\r\n".encode())
    return f"multipart/form-data; boundary={boundary}", b"".join(lines)


def decode_form(content_type: str, body: bytes) -> dict[str, list[bytes]]:
    """The contents of a multipart form by part name, in order; raises InputError for any other body."""
    kind, _, rest = content_type.partition(";")
    boundary = next((p.strip()[9:].strip('"') for p in rest.split(";") if p.strip().startswith("boundary=")), "")
    if kind.strip() != "multipart/form-data" or not boundary:
        raise InputError(f"'{kind}' is not multipart/form-data with a boundary")
    form: dict[str, list[bytes]] = {}
    for piece in (b"\r\n" + body).split(b"\r\n--" + boundary.encode())[1:-1]:
        head, _, content = piece.partition(b"\r\n\r\n")
        names = [field for field in head.decode(errors="replace").replace("\r\n", ";").split(";") if "name=" in field]
        name = next((f.strip()[5:].strip('"') for f in names if f.strip().startswith("name=")), "")
        form.setdefault(name, []).append(content)
    return form


def _view_entry(view: View) -> dict[str, Any]:
    return {
        "frame": view.frame_index,
        "rgb_camera": asdict(view.rgb_camera),
        "depth_camera": asdict(view.depth_camera),
        "world_from_camera": view.world_from_camera.matrix.tolist(),
        "depth_noise": asdict(view.noise),
        "sharpness": view.sharpness,
        "cropped": view.is_cropped,
    }


def _view(entry: dict[str, Any], png: bytes, depth: bytes) -> View:
    picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    if picture is None or picture.ndim != 3 or picture.shape[2] != 4:
        raise ValueError("an image part is not an RGBA PNG")
    rgba = cv2.cvtColor(picture, cv2.COLOR_BGRA2RGBA)
    matrix = np.asarray(entry["world_from_camera"], dtype=np.float64)
    return View(
        frame_index=int(entry["frame"]),
        rgb=np.ascontiguousarray(rgba[..., :3]),
        mask=rgba[..., 3] > 127,
        rgb_camera=Intrinsics(**entry["rgb_camera"]),
        depth_m=np.load(io.BytesIO(depth), allow_pickle=False),
        depth_camera=Intrinsics(**entry["depth_camera"]),
        world_from_camera=Rigid3(matrix[:3, :3], matrix[:3, 3]),
        noise=DepthNoise(**entry.get("depth_noise", {})),
        sharpness=float(entry["sharpness"]),
        is_cropped=bool(entry["cropped"]),
    )


def _npy(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array.astype(np.float32), allow_pickle=False)
    return buffer.getvalue()


class _NoFrames:
    """Placeholder for the pixels of a capture, which are not transmitted."""

    def rgb(self, frame_index: int) -> Image:
        """Always raises KeyError."""
        raise KeyError(frame_index)

    def depth(self, frame_index: int) -> Depth:
        """Always raises KeyError."""
        raise KeyError(frame_index)


def _capture_of(room: Room) -> Capture:
    """The transmitted part of the capture: the room, without frames and surface."""
    nothing = SceneSurface(
        vertices_world=np.zeros((0, 3)), faces=np.zeros((0, 3), np.int64), colours=np.zeros((0, 3), np.uint8), voxel_m=0.01
    )
    return Capture(
        name="remote",
        sha256="",
        format="remote",
        frames=(),
        world_from_capture=Rigid3(),
        room=room,
        surface=nothing,
        images=_NoFrames(),
        notices=(),
    )
