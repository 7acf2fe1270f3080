"""Keys of what people gave, stored beside it: masks and results are current while theirs is this one.

They are made when something changes, from the object that changed, and read by every list.
"""

import hashlib
import json
from collections.abc import Iterable
from typing import Any

from sqlalchemy import bindparam, select
from sqlmodel import Session, col

from app.db.queries import Click, clicks_by_object, live_objects
from app.db.tables import Project, SceneObject
from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.robot.arms import ARMS
from r2c2r_core.workspace import content_key

Drawn = dict[str, Any]  # what an entry of prompts.json holds beside clicks: front, frames, crop


def drawn_of(item: SceneObject) -> Drawn:
    """What was drawn of an object, as in prompts.json; empty where nothing was."""
    frames = [{"frame": int(number), "mask": mask} for number, mask in sorted(item.frames.items(), key=lambda one: int(one[0]))]
    front = {} if item.front is None else {"front": item.front}
    crop = {} if item.crop is None else {"crop": item.crop}
    return front | ({"frames": frames} if frames else {}) | crop


def masks_key(segmenter: str, category: str, clicks: Iterable[tuple[int, float, float, int]], drawn: Drawn) -> str:
    """Key of what an object's masks depend on, its name not among it.

    Empty while no click (frame, x, y, label) is on it and no front is drawn.
    """
    given: list[Any] = [[frame, x, y, label] for frame, x, y, label in clicks]
    if "front" not in drawn and not any(label for *_, label in given):
        return ""
    shown: list[Any] = []
    if "front" in drawn:
        shown.append({key: value for key, value in drawn["front"].items() if key != "hinge"})
    if drawn.get("frames"):
        shown.append(drawn["frames"])
    if drawn.get("crop"):
        shown.append(drawn["crop"])
    return hashlib.sha256(json.dumps([segmenter, category, given, *shown]).encode()).hexdigest()[:20]


def object_key(name: str, category: str, clicks: list[Click], override: dict[str, Any], drawn: Drawn) -> str:
    """Key of everything about an object that a result depends on; empty where none does."""
    prompt: list[Any] | None = [[c.frame, c.x, c.y, c.label] for c in clicks] if any(c.label for c in clicks) else None
    if "front" in drawn or (prompt and drawn):
        prompt = [*(prompt or []), *drawn.values()]
    corrected = overrides_entry(override)
    return content_key(name, category if prompt else "", prompt, corrected) if prompt or corrected else ""


def overrides_entry(stored: dict[str, Any]) -> dict[str, Any]:
    """One object of overrides.json, from what is stored about it."""
    data = {key: value for key, value in stored.items() if value not in (None, [], {})}
    limits = [data.pop("joint_lower", None), data.pop("joint_upper", None)]
    return data if limits == [None, None] else {**data, "joint_limits": limits}


def stored_entry(entry: dict[str, Any]) -> dict[str, Any]:
    """What is stored about an object, from its entry in overrides.json: the inverse of `overrides_entry`."""
    lower, upper = entry.get("joint_limits") or (None, None)
    limits = {"joint_lower": lower, "joint_upper": upper}
    rest = {key: value for key, value in entry.items() if key != "joint_limits"}
    return rest | {key: value for key, value in limits.items() if value is not None}


def note_object(session: Session, item: SceneObject, segmenter: str, clicks: list[Click], override: dict[str, Any]) -> None:
    """Store the keys of an object that changed."""
    item.masks_key = masks_key(segmenter, item.category, [(c.frame, c.x, c.y, c.label) for c in clicks], drawn_of(item))
    item.inputs = object_key(item.name, item.category, clicks, override, drawn_of(item))
    session.add(item)


def note_project(session: Session, project: Project) -> None:
    """Store the key of everything a person gave, after something of it changed."""
    session.flush()
    given = [inputs for (inputs,) in session.execute(_GIVEN, {"project": project.id})]
    project.inputs = content_key(given, project.segmenter, _chosen(project))
    session.add(project)


_GIVEN = (
    select(col(SceneObject.inputs))
    .where(col(SceneObject.project_id) == bindparam("project"), col(SceneObject.deleted).is_(False))
    .where(col(SceneObject.inputs) != "")
    .order_by(col(SceneObject.id))
)


def note_segmenter(session: Session, project: Project) -> None:
    """Store the keys of the masks after another segmenter was chosen to draw them."""
    clicks = clicks_by_object(session, project.id)
    for item in live_objects(session, project.id, deleted=True):
        clicked = [(c.frame, c.x, c.y, c.label) for c in clicks.get(item.id or 0, [])]
        item.masks_key = masks_key(project.segmenter, item.category, clicked, drawn_of(item))
        session.add(item)


def _chosen(project: Project) -> dict[str, str]:
    """What is not the default, backends by seam and how depth is read: something new leaves the keys of older results."""
    usual = {"generator": GENERATORS.default, "matcher": MATCHERS.default, "arm": ARMS.default}
    chosen = {seam: getattr(project, seam) for seam, name in usual.items() if getattr(project, seam) != name}
    chosen |= {"depth": "registered"} if project.register_depth else {}
    return chosen | ({"scale": f"{project.scale:.6f}"} if project.scale != 1.0 else {})
