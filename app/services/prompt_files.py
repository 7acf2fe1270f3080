"""Import and export of prompts.json, the command line's format of clicks and drawn fronts."""

from app import schemas
from app.db import queries
from app.db.documents import prompt_entry, prompts_version
from app.db.engine import reading, writing
from app.jobs.outcomes import adopt_prompts
from app.services.context import Context
from app.services.in_frames import check_file, table_of
from app.services.prompts import after_changes, change_of


def export(context: Context, project_id: str) -> schemas.PromptsFile:
    """The project's prompts.json."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        clicks, items = queries.clicks_by_object(session, project_id), queries.live_objects(session, project_id)
        objects = [prompt_entry(item, clicks.get(item.id or 0, [])) for item in items]
    return schemas.PromptsFile.model_validate({"version": prompts_version(objects), "objects": objects})


def adopt(context: Context, project_id: str, body: schemas.PromptsFile) -> list[schemas.SceneObject]:
    """Add the objects of a prompts file."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        check_file(table_of(context, project), body)
        items = adopt_prompts(session, project, body, context.who)
        changes = [change_of(context, session, project, item, infer=True) for item in items]
    return after_changes(context, changes)
