"""prompts.json: the clicks as the command line reads and writes them."""

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.jobs.outcomes import adopt_prompts
from app.services.context import Context
from app.services.prompts import after_change, change_of, check_point


def export(context: Context, project_id: str) -> schemas.PromptsFile:
    """The clicks as the command line reads them."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        clicks, objects = queries.clicks_by_object(session, project_id), []
        for item in queries.live_objects(session, project_id):
            points = [_file_point(click) for click in clicks.get(item.id or 0, [])]
            objects.append(schemas.PromptsFileObject(name=item.name, category=item.category, points=points))
        return schemas.PromptsFile(version=1, objects=objects)


def adopt(context: Context, project_id: str, body: schemas.PromptsFile) -> list[schemas.SceneObject]:
    """Add the objects of a prompts file."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        for entry in body.objects:
            for point in entry.points:
                check_point(context, project, point.frame, point.x, point.y)
        items = adopt_prompts(session, project, body.model_dump(), context.who)
        changes = [change_of(context, session, project, item, infer=False) for item in items]
    return [after_change(context, change) for change in changes]


def _file_point(click: queries.Click) -> schemas.PromptsFilePoint:
    return schemas.PromptsFilePoint(frame=click.frame, x=click.x, y=click.y, label=1 if click.label else 0)
