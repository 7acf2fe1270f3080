"""The clicks and corrections of a project as the files the core reads."""

from typing import Any

from pydantic import ValidationError
from sqlmodel import Session

from app.db.keys import Drawn, drawn_of, overrides_entry
from app.db.queries import Click, clicks_by_object, live_objects, overrides_by_object
from app.db.tables import SceneObject
from r2c2r_core.schema.prompts import PromptsFileFront


def prompts_document(session: Session, project_id: str) -> dict[str, Any]:
    """prompts.json of the project as it is now; objects neither clicked nor drawn are left out."""
    clicks, items = clicks_by_object(session, project_id), live_objects(session, project_id)
    objects = [prompt_entry(item, clicks.get(item.id or 0, [])) for item in items]
    given = [entry for entry in objects if "front" in entry or any(point["label"] for point in entry["points"])]
    return {"version": prompts_version(given), "objects": given}


def prompt_entry(item: SceneObject, clicks: list[Click]) -> dict[str, Any]:
    """One object of prompts.json."""
    points = [{"frame": c.frame, "x": c.x, "y": c.y, "label": c.label} for c in clicks]
    return {"name": item.name, "category": item.category, "points": points, **_readable(drawn_of(item))}


def readable_front(front: dict[str, Any]) -> dict[str, Any]:
    """A stored front; its handle is looked for where merging fronts had left it outside, which no reader takes any more."""
    try:
        PromptsFileFront.model_validate(front)
    except ValidationError:
        return front | {"handle": None}
    return front


def _readable(drawn: Drawn) -> Drawn:
    return drawn | {"front": readable_front(drawn["front"])} if "front" in drawn else drawn


def prompts_version(objects: list[dict[str, Any]]) -> int:
    """The version of prompts.json that these need: an older r2c2r reads what is only clicked."""
    if any("crop" in entry for entry in objects):
        return 3
    return 2 if any(entry.keys() & {"front", "frames"} for entry in objects) else 1


def overrides_document(session: Session, project_id: str) -> dict[str, Any]:
    """overrides.json of the project as it is now."""
    stored = overrides_by_object(session, project_id)
    entries = {item.name: overrides_entry(stored.get(item.id or 0, {})) for item in live_objects(session, project_id)}
    return {"version": 1, "objects": {name: entry for name, entry in entries.items() if entry}}
