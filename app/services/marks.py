"""Marks in the 3D view: joint axes, and where certificate findings and open comments are; the panels have their texts."""

from typing import Any

import numpy as np
from sqlmodel import Session, col, select

from app.db import queries
from app.db.tables import Comment
from app.files import ProjectFiles
from app.services import views
from r2c2r_core.model.scene import SceneObject

_REACH_M = 0.08  # by which an axis extends beyond its box, and a label stands off what it is about
_AXIS, _FINDING, _COMMENT = (86, 180, 233), (230, 90, 60), (255, 225, 77)
_CHOSEN = (255, 225, 77)
_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def marks(
    session: Session, files: ProjectFiles, project_id: str, name: str | None
) -> tuple[list[dict[str, Any]], list[float] | None]:
    """Marks of one object, or of all with None, and the camera target."""
    items = [item for item in _scene_objects(files) if name is None or item.name == name]
    bundle = queries.newest_bundle(session, project_id)
    findings = (bundle.certificate or {}).get("findings", []) if bundle else []
    found = [mark for item in items for mark in (*_axes(item), _box(item))] if name is not None else []
    told = [finding for finding in findings if name is not None or finding["severity"] == "error"]
    for item in items:
        count = sum(_is_about(finding, item.name) for finding in told)
        if count:
            found.append(_word(_above(item), f"{count} finding{'s' if count > 1 else ''}", _FINDING))
    said = select(Comment).where(Comment.project_id == project_id, col(Comment.resolved_at).is_(None))
    found += _pins([comment for comment in session.exec(said) if comment.point_world])
    return found, items[0].world_from_object.translation.tolist() if name is not None and items else None


def _is_about(finding: dict[str, Any], name: str) -> bool:
    return any(where == name or where.startswith(f"{name}_") for where in finding["where"].split(", "))


def _above(item: SceneObject) -> np.ndarray:
    """Just above the object's box, where a label hides nothing of it."""
    top = item.world_from_object.apply(_CORNERS * item.dimensions_m / 2)[:, 2].max()
    place: np.ndarray = item.world_from_object.translation.copy()
    place[2] = top + _REACH_M
    return place


def _pins(comments: list[Comment]) -> list[dict[str, Any]]:
    """A pin for each comment, those of one place under one label; the list of comments has the texts."""
    places: list[list[tuple[np.ndarray, str]]] = []
    for at, who in ((np.asarray(comment.point_world), comment.who) for comment in comments):
        near = next((place for place in places if np.linalg.norm(place[0][0] - at) < _REACH_M), None)
        if near is None:
            places.append([(at, who)])
        else:
            near.append((at, who))
    found = []
    for place in places:
        label = place[0][1] if len(place) == 1 else f"{len(place)} comments"
        found += [{**_word(at, label if k == 0 else "", _COMMENT), "pin": True} for k, (at, _) in enumerate(place)]
    return found


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
        found.append({"lines": [[start.tolist(), end.tolist()]], "colour": list(_AXIS)})
    return found


def _box(item: SceneObject) -> dict[str, Any]:
    """The edges of the chosen object's box."""
    corners = item.world_from_object.apply(_CORNERS * item.dimensions_m / 2)
    ends = [(k, m) for k in range(8) for m in range(k + 1, 8) if np.abs(_CORNERS[k] - _CORNERS[m]).sum() == 2]
    return {"lines": [[corners[k].tolist(), corners[m].tolist()] for k, m in ends], "colour": list(_CHOSEN)}


def _word(at: np.ndarray, text: str, colour: tuple[int, int, int]) -> dict[str, Any]:
    return {"text": text, "at": [float(value) for value in at], "colour": list(colour)}


def _scene_objects(files: ProjectFiles) -> tuple[SceneObject, ...]:
    for stage in ("warp", "synthesize"):
        scene = views.latest(files, stage, "scene")
        if scene is not None:
            objects: tuple[SceneObject, ...] = scene.objects
            return objects
    return ()
