"""Marks in the 3D view: joint axes, certificate findings, open comments."""

from typing import Any

import numpy as np
from sqlmodel import Session, col, select

from app.db import queries
from app.db.tables import Comment
from app.files import ProjectFiles
from app.services import views
from r2c2r_core.model.scene import SceneObject

_REACH_M = 0.08  # length by which an axis extends beyond its box
_AXIS, _FINDING, _COMMENT = (86, 180, 233), (230, 90, 60), (255, 225, 77)
_CHOSEN = (255, 225, 77)
_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_LONGEST_TEXT = 44
_LINE_M = 0.07  # distance between two findings of one object


def marks(
    session: Session, files: ProjectFiles, project_id: str, name: str | None
) -> tuple[list[dict[str, Any]], list[float] | None]:
    """Marks of one object, or of all with None, and the camera target."""
    items = [item for item in _scene_objects(files) if name is None or item.name == name]
    bundle = queries.newest_bundle(session, project_id)
    findings = (bundle.certificate or {}).get("findings", []) if bundle else []
    found = [mark for item in items for mark in (*_axes(item), _box(item))] if name is not None else []
    places = [(finding, where) for finding in findings for where in finding["where"].split(", ")]
    for finding, where in places:
        item = next((i for i in items if where == i.name or where.startswith(f"{i.name}_")), None)
        if item is not None and (name is not None or finding["severity"] == "error"):
            above = _LINE_M * sum(mark["colour"] == list(_FINDING) for mark in found)  # one object may have several
            found.append(_word(item.world_from_object.translation + np.array([0, 0, above]), finding["message"], _FINDING))
    said = select(Comment).where(Comment.project_id == project_id, col(Comment.resolved_at).is_(None))
    found += [
        {**_word(np.asarray(c.point_world), f"{c.who}: {c.text}", _COMMENT), "pin": True}
        for c in session.exec(said)
        if c.point_world
    ]
    return found, items[0].world_from_object.translation.tolist() if name is not None and items else None


def _axes(item: SceneObject) -> list[dict[str, Any]]:
    """Each joint's axis through its origin, as long as the object; a slide's starts there and shows its travel."""
    pose = item.world_from_object
    found = []
    for joint in item.joints:
        origin, axis = pose.apply(joint.origin_object), pose.rotation @ joint.axis_object
        half = float(np.abs(joint.axis_object) @ item.dimensions_m) / 2 + _REACH_M
        start, end = (
            (origin - half * axis, origin + half * axis) if joint.type == "revolute" else (origin, origin + joint.upper * axis)
        )
        source = joint.sources.get("axis", "")
        found.append({**_word(end, f"{joint.type}, axis {source}", _AXIS), "lines": [[start.tolist(), end.tolist()]]})
    return found


def _box(item: SceneObject) -> dict[str, Any]:
    """The edges of the chosen object's box."""
    corners = item.world_from_object.apply(_CORNERS * item.dimensions_m / 2)
    ends = [(k, m) for k in range(8) for m in range(k + 1, 8) if np.abs(_CORNERS[k] - _CORNERS[m]).sum() == 2]
    return {"lines": [[corners[k].tolist(), corners[m].tolist()] for k, m in ends], "colour": list(_CHOSEN)}


def _word(at: np.ndarray, text: str, colour: tuple[int, int, int]) -> dict[str, Any]:
    short = text if len(text) <= _LONGEST_TEXT else f"{text[: _LONGEST_TEXT - 1]}…"
    return {"text": short, "at": [float(value) for value in at], "colour": list(colour)}


def _scene_objects(files: ProjectFiles) -> tuple[SceneObject, ...]:
    for stage in ("warp", "synthesize"):
        scene = views.latest(files, stage, "scene")
        if scene is not None:
            objects: tuple[SceneObject, ...] = scene.objects
            return objects
    return ()
