"""prompts.json: the clicks as the command line reads and writes them."""

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Point
from app.jobs.outcomes import adopt_prompts
from app.services.context import Context
from app.services.prompts import after_change, check_point


def export(context: Context, project_id: str) -> schemas.PromptsFile:
    """The clicks as the command line reads them."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        objects = []
        for item in queries.live_objects(session, project_id):
            points = [_file_point(point) for point in queries.points_of(session, item.id)]
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
    return [after_change(context, project_id, item.id, infer=False) for item in items]


def _file_point(point: Point) -> schemas.PromptsFilePoint:
    return schemas.PromptsFilePoint(frame=point.frame, x=point.x, y=point.y, label=1 if point.label else 0)
