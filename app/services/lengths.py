"""True lengths measured in the room, their values in the scan, and the resulting scale."""

import time
from typing import Any

import numpy as np
from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Event, Project, TrueLength
from app.errors import NotFound
from app.services import projects
from app.services.context import Context
from app.services.scenes import fitted

_SIDES = ("width", "depth", "height")


def list_lengths(context: Context, project_id: str) -> schemas.TrueLengths:
    """All true lengths of a project, oldest first, with their current values in the scan."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        return _all(context, session, project)


def add(context: Context, project_id: str, body: schemas.TrueLengthIn) -> schemas.TrueLengths:
    """Add a length."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        text = body.text or "between two points"
        if body.object is not None:
            item = queries.object_row(session, project_id, body.object)
            text = body.text or f"{body.side} of {item.name}"
        row = TrueLength(
            project_id=project_id,
            object_id=body.object,
            side=body.side or "",
            points_world=body.points_world,
            scale=project.scale,
            metres=body.metres,
            text=text,
            who=context.who,
            at=time.time(),
        )
        session.add(row)
        session.flush()
        _note(session, row, "measure", f"measured: {text} is {_mm(body.metres)}", context.who)
        found = _all(context, session, project)
    projects.tell(context, project_id)
    return found


def remove(context: Context, project_id: str, length_id: int) -> schemas.TrueLengths:
    """Delete a length; the history keeps it."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        row = session.get(TrueLength, length_id)
        if row is None or row.project_id != project_id:
            raise NotFound(f"no true length {length_id} in this project", hint="it may have been removed in the meantime")
        _note(session, row, "unmeasure", f"removed: {row.text} is {_mm(row.metres)}", context.who)
        session.delete(row)
        session.flush()
        found = _all(context, session, project)
    projects.tell(context, project_id)
    return found


def best_scale(pairs: list[tuple[float, float]]) -> float:
    """Scale factor of measured lengths with the least relative squared error: pairs are (measured, true)."""
    ratios = np.array([measured / true for measured, true in pairs])
    return float(ratios.sum() / (ratios**2).sum())


def _all(context: Context, session: Session, project: Project) -> schemas.TrueLengths:
    rows = session.exec(select(TrueLength).where(TrueLength.project_id == project.id).order_by(col(TrueLength.id))).all()
    names = {item.id: item.result_name for item in queries.live_objects(session, project.id)}
    sizes = _sizes(fitted(context.files(project)), project.scale) if rows else {}
    found = [_measured(row, project, sizes.get(names.get(row.object_id, ""))) for row in rows]
    lengths = [_shape(row, *one, project.scale) for row, one in zip(rows, found, strict=True)]
    pairs = [(one.measured_m, one.metres) for one in lengths if one.measured_m and one.compared]
    wanted = best_scale(pairs) if pairs else None
    return schemas.TrueLengths(
        lengths=lengths,
        scale=project.scale,
        scale_wanted=None if wanted is None else float(np.clip(project.scale * wanted, 0.2, 5.0)),
        mean_error=_mean_error(pairs, 1.0),
        mean_error_scaled=None if wanted is None else _mean_error(pairs, wanted),
    )


def _sizes(scene: dict[str, Any] | None, scale: float) -> dict[str, list[tuple[float, bool]]]:
    """The sides of each object at the project's scale, and whether they come from the scan.

    The scene keeps the scale of its run until the next one. Sides that a person or the category set have no scale.
    """
    if scene is None:
        return {}
    since = scale / (scene["scale"] or scale)
    return {
        entry["name"]: [
            (size, False) if source in ("person", "default") else (since * size, True)
            for size, source in zip(entry["dimensions_m"], entry["dimension_sources"], strict=True)
        ]
        for entry in scene["objects"]
    }


def _measured(row: TrueLength, project: Project, sides: list[tuple[float, bool]] | None) -> tuple[float | None, bool]:
    """A length's value now, in metres, and whether it comes from the scan."""
    points = points_now(row, project.scale)
    if points is not None:
        return float(np.linalg.norm(np.subtract(points[1], points[0]))), True
    return sides[_SIDES.index(row.side)] if sides else (None, False)


def _mean_error(pairs: list[tuple[float, float]], scale: float) -> float | None:
    return float(np.mean([abs(scale * measured - true) / true for measured, true in pairs])) if pairs else None


def points_now(row: TrueLength, scale: float) -> list[list[float]] | None:
    """The two points of a length in the world at a given scale; None for an object's side."""
    return row.points_world and [[float(value) * scale / row.scale for value in point] for point in row.points_world]


def _shape(row: TrueLength, measured: float | None, of_scan: bool, scale: float) -> schemas.TrueLength:
    side: Any = row.side or None
    return schemas.TrueLength(
        id=row.id or 0,
        text=row.text,
        object=row.object_id,
        side=side,
        points_world=points_now(row, scale),
        metres=row.metres,
        measured_m=measured,
        error_m=None if measured is None else measured - row.metres,
        compared=of_scan,
        who=row.who,
        at=row.at,
    )


def _note(session: Session, row: TrueLength, action: str, text: str, who: str) -> None:
    event = Event(project_id=row.project_id, scope="project", action=action, text=text, who=who, at=time.time())
    event.after = {"length": row.id, "metres": row.metres}
    session.add(event)


def _mm(metres: float) -> str:
    return f"{1000 * metres:.0f} mm"
