"""Elevations drawn by the live segmenter, and detected fronts."""

import json
from pathlib import Path

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.errors import NotFound
from app.files import ProjectFiles
from app.jobs.elevation_files import INDEX, picture_path
from app.services import masks
from app.services.context import Context


def current(context: Context, project_id: str) -> schemas.Elevations:
    """Elevations of the project's scan; opening the live segmenter creates them."""
    with reading(context.engine) as session:
        files = context.files(queries.project_row(session, project_id))
    index = files.elevations / INDEX
    try:
        entries, version = json.loads(index.read_text()), index.stat().st_mtime_ns
    except FileNotFoundError:
        return schemas.Elevations(drawn=False, items=[])
    at = f"/media/{project_id}/elevations"
    items = [schemas.Elevation(url=f"{at}/{entry['id']}.png?v={version:x}", **entry) for entry in entries]
    return schemas.Elevations(drawn=True, items=items)


def picture(context: Context, project_id: str, number: int) -> Path:
    """The picture of one elevation."""
    with reading(context.engine) as session:
        files: ProjectFiles = context.files(queries.drawn_in(session, project_id))
    path = picture_path(files.elevations, number)
    if not path.is_file():
        raise NotFound(f"no elevation {number}", hint="open the project's elevations: they are drawn when its masks are")
    return path


def found_fronts(context: Context, project_id: str) -> list[schemas.FoundFront]:
    """The flat fronts of objects with completed masks."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        items = queries.live_objects(session, project_id)
    places = masks.Places.of(context.files(project))
    known = [(item.id or 0, masks.front_of(context, project, item, places)) for item in items]
    return [schemas.FoundFront(object=number, **front) for number, front in known if front is not None]
