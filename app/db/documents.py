"""A project's clicks and corrections as the documents read by the core."""

from collections.abc import Collection, Iterable
from typing import Any

from pydantic import ValidationError
from sqlmodel import Session

from app.db.keys import Drawn, drawn_of, overrides_entry
from app.db.queries import Click, clicks_by_object, live_objects, overrides_by_object
from app.db.tables import SceneObject
from r2c2r_core.schema.prompts import PromptsFileFront


def prompts_document(session: Session, project_id: str) -> dict[str, Any]:
    """Current prompts.json of the project, without objects that have neither clicks nor a drawn front."""
    return _document_of(_entries(session, project_id).values())


def corrected_prompts(
    session: Session, project_id: str, finished: dict[str, Any], about: Collection[int | None]
) -> dict[str, Any]:
    """prompts.json of the last run, updated for these objects and without objects deleted since.

    Other newer clicks may be unfinished and are not included in a correction's run.
    """
    before, now = {entry["name"]: entry for entry in finished["objects"]}, _entries(session, project_id)
    chosen = []
    for item in live_objects(session, project_id):
        if item.id in about and item.id in now:
            chosen.append(now[item.id])
        elif item.id not in about and item.result_name in before:
            chosen.append({**before[item.result_name], "name": item.name})
    return _document_of(chosen)


def _entries(session: Session, project_id: str) -> dict[int, dict[str, Any]]:
    """Entries of prompts.json by object, of those with a positive click or a drawn front."""
    clicks, items = clicks_by_object(session, project_id), live_objects(session, project_id)
    entries = {item.id or 0: prompt_entry(item, clicks.get(item.id or 0, [])) for item in items}
    return {
        number: entry
        for number, entry in entries.items()
        if "front" in entry or any(point["label"] for point in entry["points"])
    }


def _document_of(entries: Iterable[dict[str, Any]]) -> dict[str, Any]:
    objects = list(entries)
    return {"version": prompts_version(objects), "objects": objects}


def prompt_entry(item: SceneObject, clicks: list[Click]) -> dict[str, Any]:
    """One object of prompts.json."""
    points = [{"frame": c.frame, "x": c.x, "y": c.y, "label": c.label} for c in clicks]
    return {"name": item.name, "category": item.category, "points": points, **_readable(drawn_of(item))}


def readable_front(front: dict[str, Any]) -> dict[str, Any]:
    """A stored front; a handle outside it, left by an earlier merge of fronts, is reset to automatic, as readers refuse it."""
    try:
        PromptsFileFront.model_validate(front)
    except ValidationError:
        return front | {"handle": None}
    return front


def _readable(drawn: Drawn) -> Drawn:
    return drawn | {"front": readable_front(drawn["front"])} if "front" in drawn else drawn


def prompts_version(objects: list[dict[str, Any]]) -> int:
    """The lowest version of prompts.json that these objects need, so that an older r2c2r can read clicks."""
    if any("crop" in entry for entry in objects):
        return 3
    return 2 if any(entry.keys() & {"front", "frames"} for entry in objects) else 1


def overrides_document(session: Session, project_id: str) -> dict[str, Any]:
    """Current overrides.json of the project."""
    stored = overrides_by_object(session, project_id)
    entries = {item.name: overrides_entry(stored.get(item.id or 0, {})) for item in live_objects(session, project_id)}
    return {"version": 1, "objects": {name: entry for name, entry in entries.items() if entry}}
