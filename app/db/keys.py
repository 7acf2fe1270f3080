"""Content keys of user input, stored with it; masks and results are current while their key matches.

Keys are computed when an object changes, and read by every list.
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

Drawn = dict[str, Any]  # an entry of prompts.json without clicks: front, frames, crop


def drawn_of(item: SceneObject) -> Drawn:
    """An object's drawn parts, as in prompts.json; empty without any."""
    frames = [{"frame": int(number), "mask": mask} for number, mask in sorted(item.frames.items(), key=lambda one: int(one[0]))]
    front = {} if item.front is None else {"front": item.front}
    crop = {} if item.crop is None else {"crop": item.crop}
    return front | ({"frames": frames} if frames else {}) | crop


def masks_key(segmenter: str, category: str, clicks: Iterable[tuple[int, float, float, int]], drawn: Drawn) -> str:
    """Key of all inputs of an object's masks, which do not include its name.

    Empty without a positive click (frame, x, y, label) and without a drawn front.
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
    """Key of all inputs of an object's results; empty where there are none."""
    prompt: list[Any] | None = [[c.frame, c.x, c.y, c.label] for c in clicks] if any(c.label for c in clicks) else None
    if "front" in drawn or (prompt and drawn):
        prompt = [*(prompt or []), *drawn.values()]
    corrected = overrides_entry(override)
    return content_key(name, category if prompt else "", prompt, corrected) if prompt or corrected else ""


def overrides_entry(stored: dict[str, Any]) -> dict[str, Any]:
    """An object's entry in overrides.json, from its stored corrections."""
    data = {key: value for key, value in stored.items() if value not in (None, [], {})}
    limits = [data.pop("joint_lower", None), data.pop("joint_upper", None)]
    return data if limits == [None, None] else {**data, "joint_limits": limits}


def stored_entry(entry: dict[str, Any]) -> dict[str, Any]:
    """Stored corrections of an object, from its entry in overrides.json: the inverse of `overrides_entry`."""
    lower, upper = entry.get("joint_limits") or (None, None)
    limits = {"joint_lower": lower, "joint_upper": upper}
    rest = {key: value for key, value in entry.items() if key != "joint_limits"}
    return rest | {key: value for key, value in limits.items() if value is not None}


def note_object(session: Session, item: SceneObject, segmenter: str, clicks: list[Click], override: dict[str, Any]) -> None:
    """Update the keys of a changed object."""
    item.masks_key = masks_key(segmenter, item.category, [(c.frame, c.x, c.y, c.label) for c in clicks], drawn_of(item))
    item.inputs = object_key(item.name, item.category, clicks, override, drawn_of(item))
    session.add(item)


def note_project(session: Session, project: Project) -> None:
    """Update the project's key of all user input after a change."""
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
    """Update the keys of all masks after a change of the segmenter."""
    clicks = clicks_by_object(session, project.id)
    for item in live_objects(session, project.id, deleted=True):
        clicked = [(c.frame, c.x, c.y, c.label) for c in clicks.get(item.id or 0, [])]
        item.masks_key = masks_key(project.segmenter, item.category, clicked, drawn_of(item))
        session.add(item)


def _chosen(project: Project) -> dict[str, str]:
    """Non-default backends and reading options only, so that new options do not change the keys of older results."""
    usual = {"generator": GENERATORS.default, "matcher": MATCHERS.default, "arm": ARMS.default}
    chosen = {seam: getattr(project, seam) for seam, name in usual.items() if getattr(project, seam) != name}
    chosen |= {"depth": "registered"} if project.register_depth else {}
    return chosen | ({"scale": f"{project.scale:.6f}"} if project.scale != 1.0 else {})
