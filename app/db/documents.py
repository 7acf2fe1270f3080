"""The clicks and corrections of a project as the files the core reads, and a key that changes when they do."""

from typing import Any

from sqlmodel import Session

from app.db import history
from app.db.queries import live_objects, points_of, project_row
from app.db.tables import Project
from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.workspace import content_key


def prompts_document(session: Session, project_id: str) -> dict[str, Any]:
    """prompts.json of the project as it is now; objects without a click on them are left out."""
    objects = []
    for item in live_objects(session, project_id):
        points = points_of(session, item.id)
        if any(p.label == 1 for p in points):
            clicks = [{"frame": p.frame, "x": p.x, "y": p.y, "label": p.label} for p in points]
            objects.append({"name": item.name, "category": item.category, "points": clicks})
    return {"version": 1, "objects": objects}


def overrides_document(session: Session, project_id: str) -> dict[str, Any]:
    """overrides.json of the project as it is now."""
    entries = {}
    for item in live_objects(session, project_id):
        data = overrides_entry(history.override_data(session, item))
        if data:
            entries[item.name] = data
    return {"version": 1, "objects": entries}


def overrides_entry(stored: dict[str, Any]) -> dict[str, Any]:
    """One object of overrides.json, from what is stored about it."""
    data = {key: value for key, value in stored.items() if value not in (None, [])}
    lower, upper = data.pop("joint_lower", None), data.pop("joint_upper", None)
    if upper is not None:
        data["joint_limits"] = [lower if lower is not None else 0.0, upper]
    return data


def inputs_key(session: Session, project_id: str) -> str:
    """Key of everything a person gave: a result is current while its key is this one."""
    project = project_row(session, project_id)
    others = [f"{seam} {name}" for seam, name in _chosen(project).items()]
    return content_key(
        prompts_document(session, project_id), overrides_document(session, project_id), project.segmenter, *others
    )


def _chosen(project: Project) -> dict[str, str]:
    """Backends that are not the default, by seam: results from before they could be chosen stay current."""
    usual = {"generator": GENERATORS.default, "matcher": MATCHERS.default}
    return {seam: getattr(project, seam) for seam, name in usual.items() if getattr(project, seam) != name}
