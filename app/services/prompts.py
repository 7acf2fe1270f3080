"""Objects and clicks. Every change is stored, with what was before it, before the answer goes out."""

import re

from sqlalchemy import func
from sqlmodel import Session, select

from app import schemas
from app.db import history, queries
from app.db.engine import reading, writing
from app.db.tables import Point, Project, SceneObject
from app.errors import Conflict, NotFound
from app.services import masks
from app.services.context import Context
from app.services.projects import frame_table
from r2c2r_core.errors import PromptError

_NAME = re.compile(r"[A-Za-z0-9_]+")


def list_objects(context: Context, project_id: str, deleted: bool) -> list[schemas.SceneObject]:
    """The project's objects in the order they were made."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        items = queries.live_objects(session, project_id, deleted=deleted)
        clicks = queries.clicks_by_object(session, project_id)
        steps = history.steps(session, project_id, "prompts")
        saved = queries.saved(session, project_id)
    return [
        _shape(
            context, project, item, clicks.get(item.id or 0, []), steps.get(item.id, history.Steps()), saved.get(item.id, 0.0)
        )
        for item in items
    ]


def create(context: Context, project_id: str, body: schemas.ObjectIn, infer: bool) -> schemas.SceneObject:
    """A new object, with its first clicks if there are any."""
    return create_all(context, project_id, [body], infer, what="added")[0]


def create_all(
    context: Context, project_id: str, bodies: list[schemas.ObjectIn], infer: bool, *, what: str
) -> list[schemas.SceneObject]:
    """New objects, all or none; `what` was done, as the history says it."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        made = [(_create(context, session, project, body, what).id, infer and bool(body.points)) for body in bodies]
    return [after_change(context, project_id, number, follow) for number, follow in made]


def edit(context: Context, project_id: str, object_id: int, body: schemas.ObjectPatch) -> schemas.SceneObject:
    """Rename, recategorise, recolour."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        refuse_overtaken(context, session, project, item, body)
        wanted = _wanted(session, item, body)
        text = ", ".join(f"{key} of {item.name} → {value}" for key, value in wanted.items()) or "nothing"
        with history.change(session, item, "prompts", "edit", text, who=context.who):
            for key, value in wanted.items():
                setattr(item, key, value)
            session.add(item)
    return after_change(context, project_id, object_id, infer="category" in wanted)


def refuse_overtaken(
    context: Context, session: Session, project: Project, item: SceneObject, body: schemas.ObjectPatch | schemas.UndoRequest
) -> None:
    """Raise Conflict, with what is stored now, when somebody changed the object since the sender last looked."""
    if body.version is None or body.version == item.version:
        return
    current = _shape_of(context, session, project, item).model_dump()
    raise Conflict(f"{item.name} was changed meanwhile", hint="look at what is stored now", current=current)


def delete(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Take the object out; undo brings it back."""
    with writing(context.engine) as session:
        item = queries.object_row(session, project_id, object_id)
        with history.change(session, item, "prompts", "delete", f"deleted {item.name}", who=context.who):
            item.deleted = True
            session.add(item)
    context.live.cancel(project_id, object_id)
    return after_change(context, project_id, object_id, infer=False)


def add_point(context: Context, project_id: str, object_id: int, body: schemas.PointIn, infer: bool) -> schemas.SceneObject:
    """One click."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        check_point(context, project, body.frame, body.x, body.y)
        text = f"{'+' if body.label else '-'} point on {item.name}, frame {body.frame}"
        with history.change(session, item, "prompts", "add point", text, who=context.who, frame=body.frame):
            session.add(Point(object_id=item.id or 0, **body.model_dump()))
    return after_change(context, project_id, object_id, infer)


def add_points(context: Context, project_id: str, object_id: int, body: schemas.PointsIn, infer: bool) -> schemas.SceneObject:
    """Clicks that belong together, as one change."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        for point in body.points:
            check_point(context, project, point.frame, point.x, point.y)
        frame = body.points[0].frame
        text = f"{len(body.points)} points on {item.name}, frame {frame}"
        with history.change(session, item, "prompts", "add points", text, who=context.who, frame=frame):
            session.add_all(Point(object_id=item.id or 0, **point.model_dump()) for point in body.points)
    return after_change(context, project_id, object_id, infer)


def move_point(
    context: Context, project_id: str, object_id: int, point_id: int, body: schemas.PointPatch, infer: bool
) -> schemas.SceneObject:
    """Move a click or flip its label."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        point = _point(session, item, point_id)
        changes = body.model_dump(exclude_none=True)
        check_point(context, project, point.frame, changes.get("x", point.x), changes.get("y", point.y))
        text = f"moved a point of {item.name}, frame {point.frame}"
        with history.change(session, item, "prompts", "move point", text, who=context.who, frame=point.frame):
            point.sqlmodel_update(changes)
            session.add(point)
    return after_change(context, project_id, object_id, infer)


def delete_point(context: Context, project_id: str, object_id: int, point_id: int, infer: bool) -> schemas.SceneObject:
    """Take a click away."""
    with writing(context.engine) as session:
        item = queries.object_row(session, project_id, object_id)
        point = _point(session, item, point_id)
        text = f"removed a point of {item.name}, frame {point.frame}"
        with history.change(session, item, "prompts", "remove point", text, who=context.who, frame=point.frame):
            session.delete(point)
    return after_change(context, project_id, object_id, infer)


def segment(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Compute the object's masks now, also when there are some for these clicks."""
    masks.segment(context, project_id, object_id)
    return tell_object(context, project_id, object_id)


def cancel_segment(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Stop computing the object's masks; those there stay."""
    masks.cancel(context, project_id, object_id)
    return tell_object(context, project_id, object_id)


def _create(context: Context, session: Session, project: Project, body: schemas.ObjectIn, what: str) -> SceneObject:
    for point in body.points:
        check_point(context, project, point.frame, point.x, point.y)
    category = body.category
    name = _free_name(session, project.id, category) if not body.name else _name(session, project.id, body.name, None)
    count = session.exec(select(func.count()).select_from(SceneObject).where(SceneObject.project_id == project.id)).one()
    item = SceneObject(project_id=project.id, name=name, category=category, colour=count, deleted=True)
    session.add(item)
    session.flush()
    frame = body.points[0].frame if body.points else None
    with history.change(session, item, "prompts", "create", f"{what} {name}", who=context.who, frame=frame):
        item.deleted = False
        session.add(item)
        session.add_all(Point(object_id=item.id or 0, **point.model_dump()) for point in body.points)
    return item


def object_shape(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """One object as it goes over the wire, also a deleted one."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id, deleted=True)
        return _shape_of(context, session, project, item)


def tell_object(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Show the object's state to every tab."""
    shape = object_shape(context, project_id, object_id)
    context.hub.publish("object", project_id, object=shape.model_dump())
    return shape


def after_change(context: Context, project_id: str, object_id: int | None, infer: bool) -> schemas.SceneObject:
    """What follows from a stored change: masks where asked for, and every tab told."""
    if infer and object_id is not None:
        masks.follow(context, project_id, object_id)
    return tell_object(context, project_id, object_id or 0)


def _shape_of(context: Context, session: Session, project: Project, item: SceneObject) -> schemas.SceneObject:
    steps = history.steps(session, project.id, "prompts", item.id).get(item.id, history.Steps())
    saved = queries.saved(session, project.id, item.id).get(item.id, 0.0)
    return _shape(context, project, item, queries.clicks_of(session, item.id), steps, saved)


def _shape(
    context: Context, project: Project, item: SceneObject, clicks: list[queries.Click], steps: history.Steps, saved: float
) -> schemas.SceneObject:
    state, frames, notices = masks.state_of(context, project, item)
    return schemas.SceneObject(
        id=item.id or 0,
        project=item.project_id,
        name=item.name,
        category=item.category,
        colour=item.colour,
        version=item.version,
        deleted=item.deleted,
        points=[schemas.Point(id=p.id or 0, frame=p.frame, x=p.x, y=p.y, label=1 if p.label else 0) for p in clicks],
        can_undo=steps.undo,
        can_redo=steps.redo,
        segment=state,
        mask_frames=frames,
        mask_backend=project.segmenter if frames else "",
        notices=[*notices, *_category_notice(item.category)],
        saved=saved,
    )


def _wanted(session: Session, item: SceneObject, body: schemas.ObjectPatch) -> dict[str, object]:
    """What the patch changes, checked."""
    wanted: dict[str, object] = {}
    if body.name is not None and body.name != item.name:
        wanted["name"] = _name(session, item.project_id, body.name, item.id)
    if body.category is not None and body.category != item.category:
        wanted["category"] = body.category
    if body.colour is not None and body.colour != item.colour:
        wanted["colour"] = body.colour
    return wanted


def _point(session: Session, item: SceneObject, point_id: int) -> Point:
    found = session.get(Point, point_id)
    if found is None or found.object_id != item.id:
        raise NotFound(f"no point {point_id} on {item.name}", hint="it may have been removed meanwhile")
    return found


def check_point(context: Context, project: Project, frame: int, x: float, y: float) -> None:
    """Raise PromptError for a click that is on no frame or outside its image."""
    table = {entry["index"]: entry for entry in frame_table(context.files(project))}
    if frame not in table:
        raise PromptError(f"the recording has no frame {frame}", hint=f"its {len(table)} frames are listed under /frames")
    width, height = table[frame]["width"], table[frame]["height"]
    if not (0 <= x < width and 0 <= y < height):
        raise PromptError(
            f"the click at ({x:g}, {y:g}) is outside the image of {width}x{height}", hint="click inside the image"
        )


def _name(session: Session, project_id: str, name: str, mine: int | None) -> str:
    """The name, when simulators accept it and no other object has it."""
    if not _NAME.fullmatch(name):
        raise PromptError(
            f"the name '{name}' is not usable", hint="use letters, digits and underscores: simulators accept no more"
        )
    if name.casefold() in _names(session, project_id, mine):
        raise PromptError(f"two objects named '{name}'", hint="names are unique: choose another one")
    return name


def _free_name(session: Session, project_id: str, category: str) -> str:
    stem = re.sub(r"[^A-Za-z0-9]+", "_", category).strip("_") or "object"
    taken = _names(session, project_id, None)
    number = 1
    while f"{stem}_{number}".casefold() in taken:
        number += 1
    return f"{stem}_{number}"


def _names(session: Session, project_id: str, without: int | None) -> set[str]:
    return {item.name.casefold() for item in queries.live_objects(session, project_id) if item.id != without}


def _category_notice(category: str) -> list[str]:
    from r2c2r_core.kitchen.names import named

    notice = named(category).notice
    return [notice] if notice else []
