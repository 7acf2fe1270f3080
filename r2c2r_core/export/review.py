"""review.html: the scene in 3D, with its joints and findings, on a page that opens without a server or a network."""

import base64
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Image, Points, Vector3
from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.seen import Seen, unseen_words
from r2c2r_core.export.writers.meshes import boxes_mesh, convex_hull
from r2c2r_core.model.report import Certificate, Finding

_ASSETS = Path(__file__).parent / "review_page"
_MODULES = ("algebra.js", "device.js", "kitchen.js", "eye.js", "painter.js", "hand.js", "panel.js", "main.js")
_IMPORT, _EXPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE), re.compile(r"^export ", re.MULTILINE)
_TEXTURE_PX = 1024  # longest side: a page of a few megabytes
_JPEG_QUALITY = 85
_STEPS = 65535  # positions are quantised in their bounding box: 0.03 mm on a fixture of 2 m


def review_html(plan: Plan, certificate: Certificate, seen_from: Vector3 | None, seen: Mapping[str, Seen] | None = None) -> str:
    """The page; `seen_from` is the camera path's position in the world, so that fronts face the viewer."""
    page = (_ASSETS / "page.html").read_text(encoding="utf-8")
    for mark, content in (("STYLE", (_ASSETS / "page.css").read_text(encoding="utf-8")), ("VIEWER", _script())):
        page = page.replace(f"/*{mark}*/", content)
    document = json.dumps(_scene(plan, certificate, seen_from, seen or {}), allow_nan=False)
    return page.replace("/*SCENE*/", document.replace("<", "\\u003c"))  # no name can end the script element


def _script() -> str:
    """The viewer's modules as one script in a private scope, each after its imports."""
    texts = [_IMPORT.sub("", (_ASSETS / name).read_text(encoding="utf-8")) for name in _MODULES]
    return "(() => {\n" + "\n".join(_EXPORT.sub("", text) for text in texts) + "})();"


def _scene(plan: Plan, certificate: Certificate, seen_from: Vector3 | None, seen: Mapping[str, Seen]) -> dict[str, Any]:
    numbers = {body.name: k for k, body in enumerate(plan.bodies)}
    pictures: dict[str, Image] = {}
    for body in plan.bodies:
        if body.link.visual is not None and body.texture_file is not None:
            pictures.setdefault(body.texture_file, body.link.visual.texture)
    files = list(pictures)
    return {
        "name": plan.name,
        "passed": certificate.passed,
        "yaw": _yaw(plan, seen_from),
        "textures": [_jpeg_address(pictures[file]) for file in files],
        "objects": [
            {"name": name, "text": _caption(plan, name, seen.get(name))}
            for name in dict.fromkeys(body.object_name for body in plan.bodies)
        ],
        "findings": [_finding(one, plan) for one in certificate.findings],
        "bodies": [_body(body, numbers, files) for body in plan.bodies],
    }


def _body(body: Body, numbers: dict[str, int], files: list[str]) -> dict[str, Any]:
    joint = body.joint
    said = None
    if joint is not None and body.axis_body is not None:
        said = {"name": body.joint_name, "kind": joint.type, "axis": body.axis_body.tolist(), "lower": joint.lower}
        said["upper"] = joint.upper
    return {
        "name": body.name,
        "object": body.object_name,
        "parent": -1 if body.parent == WORLD else numbers[body.parent],
        "pose": body.parent_from_body.matrix.T.ravel().round(7).tolist(),  # WebGL reads columns
        "joint": said,
        "surface": _surface(body, files),
        "colliders": _packed(*_collider_mesh(body), colour=_tint(numbers[body.name])),
    }


def _surface(body: Body, files: list[str]) -> dict[str, Any] | None:
    visual = body.link.visual
    if visual is None or body.texture_file is None:
        return _packed(*boxes_mesh(body), colour=body.link.colour)
    number = files.index(body.texture_file)
    return _packed(visual.vertices, visual.faces, uv=visual.uv, texture=number, colour=body.link.colour)


def _packed(
    vertices: Points, faces: Faces, *, colour: tuple[float, ...], uv: np.ndarray | None = None, texture: int = -1
) -> dict[str, Any] | None:
    if len(faces) == 0:
        return None
    low, span = vertices.min(axis=0), np.maximum(np.ptp(vertices, axis=0), 1e-6)
    flat = np.zeros((len(vertices), 2)) if uv is None else uv
    return {
        "low": low.round(6).tolist(),
        "span": span.round(6).tolist(),
        "positions": _base64(np.rint((vertices - low) / span * _STEPS).astype("<u2")),
        "uv": _base64(np.rint(np.clip(flat, 0, 1) * _STEPS).astype("<u2")),
        "indices": _base64(faces.astype("<u4")),
        "texture": texture,
        "colour": [round(float(value), 4) for value in colour],
    }


def _collider_mesh(body: Body) -> tuple[Points, Faces]:
    meshes = [boxes_mesh(body), *(convex_hull(piece.vertices_link, piece.name) for piece in body.link.pieces)]
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)


def _finding(finding: Finding, plan: Plan) -> dict[str, Any]:
    """A finding with the object that it concerns, identified by link, joint or object name."""
    names = {body.object_name for body in plan.bodies}
    owners = {key: body.object_name for body in plan.bodies for key in (body.name, body.joint_name)}
    owner = finding.where if finding.where in names else owners.get(finding.where)
    return {"severity": finding.severity, "message": f"{finding.where}: {finding.message}", "object": owner}


def _caption(plan: Plan, object_name: str, seen: Seen | None) -> str:
    joints = sum(body.joint is not None for body in plan.of(object_name))
    mass = sum(body.link.inertial.mass_kg for body in plan.of(object_name))
    jointed = f", {joints} joint{'s' if joints > 1 else ''}" if joints else ""
    guess = f"; {words}" if seen is not None and (words := unseen_words(seen.unseen)) else ""
    return f"{object_name}: {mass:.1f} kg{jointed}{guess}"


def _yaw(plan: Plan, seen_from: Vector3 | None) -> float:
    """Direction in plan, in radians, from the scene's middle to the filming position; a corner view without a camera."""
    if seen_from is None:
        return -1.1
    middle = np.mean([body.world_from_body.translation for body in plan.bodies], axis=0)
    towards = seen_from - middle
    return float(np.arctan2(towards[1], towards[0]))


def _tint(number: int) -> tuple[float, float, float]:
    """Distinct collider colours for neighbouring bodies, by golden-angle steps of the hue."""
    hue = np.array([[[int(number * 137.508 % 360 / 2), 110, 215]]], dtype=np.uint8)
    red, green, blue = cv2.cvtColor(hue, cv2.COLOR_HSV2RGB)[0, 0] / 255.0
    return float(red), float(green), float(blue)


def _jpeg_address(image: Image) -> str:
    scale = min(1.0, _TEXTURE_PX / max(image.shape[:2]))
    size = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA) if scale < 1 else image
    _, encoded = cv2.imencode(".jpg", small[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return "data:image/jpeg;base64," + base64.b64encode(encoded.tobytes()).decode()


def _base64(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
