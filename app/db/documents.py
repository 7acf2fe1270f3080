"""The clicks and corrections of a project as the files the core reads."""

from typing import Any

from sqlmodel import Session

from app.db.keys import overrides_entry
from app.db.queries import clicks_by_object, live_objects, overrides_by_object


def prompts_document(session: Session, project_id: str) -> dict[str, Any]:
    """prompts.json of the project as it is now; objects without a click on them are left out."""
    clicks, objects = clicks_by_object(session, project_id), []
    for item in live_objects(session, project_id):
        mine = clicks.get(item.id or 0, [])
        if any(click.label for click in mine):
            points = [{"frame": c.frame, "x": c.x, "y": c.y, "label": c.label} for c in mine]
            objects.append({"name": item.name, "category": item.category, "points": points})
    return {"version": 1, "objects": objects}


def overrides_document(session: Session, project_id: str) -> dict[str, Any]:
    """overrides.json of the project as it is now."""
    stored = overrides_by_object(session, project_id)
    entries = {item.name: overrides_entry(stored.get(item.id or 0, {})) for item in live_objects(session, project_id)}
    return {"version": 1, "objects": {name: entry for name, entry in entries.items() if entry}}
