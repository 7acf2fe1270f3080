"""Objects and clicks. Every change is stored with its previous state before the answer is sent."""

from typing import Any, NamedTuple

from sqlalchemy import func
from sqlmodel import Session, select

from app import schemas
from app.db import history, once, queries
from app.db.documents import readable_front
from app.db.engine import reading, writing
from app.db.tables import Point, Project, SceneObject
from app.errors import Conflict, NotFound
from app.files import ProjectFiles
from app.services import assigning, masks
from app.services.context import Context
from app.services.in_frames import check_point, check_said, table_of
from r2c2r_core.errors import PromptError
from r2c2r_core.texts import identifier, name_fault
from r2c2r_core.workspace import noun_path

_ACTIONS = {"assignee": "assign", "locked_by": "lock"}  # by the changed field: the two that no result depends on


class Change(NamedTuple):
    """A changed object with its API schema."""

    project: Project
    item: SceneObject
    shape: schemas.SceneObject
    infer: bool


def list_objects(context: Context, project_id: str, deleted: bool) -> list[dict[str, Any]]:
    """The project's objects in order of creation, in the format of schemas.SceneObject, unvalidated for speed."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        items = queries.live_objects(session, project_id, deleted=deleted)
        clicks = queries.clicks_by_object(session, project_id)
        steps = history.steps(session, project_id, "prompts")
        saved = queries.saved(session, project_id)
    places = masks.Places.of(context.files(project))
    return [
        _shape(context, project, item, [], steps.get(item.id, history.Steps()), saved.get(item.id, 0.0), places).model_dump()
        | {"points": [click._asdict() for click in clicks.get(item.id or 0, [])]}
        for item in items
    ]


def create(context: Context, project_id: str, body: schemas.ObjectIn, infer: bool) -> schemas.SceneObject:
    """Create an object, with its first clicks if given."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = create_in(context, session, project, body, "added")
        change = answered_change(context, session, project, item, infer and _gives_masks(body))
    return after_change(context, change)


def create_all(
    context: Context, project_id: str, bodies: list[schemas.ObjectIn], infer: bool, *, what: str
) -> list[schemas.SceneObject]:
    """Create objects, all or none; `what` is the action in the history."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        items = [create_in(context, session, project, body, what) for body in bodies]
        made = [
            change_of(context, session, project, item, infer and _gives_masks(body))
            for item, body in zip(items, bodies, strict=True)
        ]
    return after_changes(context, made)


def edit(context: Context, project_id: str, object_id: int, body: schemas.ObjectPatch) -> schemas.SceneObject:
    """Change an object's fields."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        refuse_overtaken(context, session, project, item, body)
        if body.locked is not False:
            _refuse_locked(item)
        wanted = _wanted(context, session, item, body)
        text = ", ".join(_said_of(item, key, value) for key, value in wanted.items()) or "nothing"
        action = _ACTIONS.get(" ".join(wanted), "edit")
        with history.change(session, item, "prompts", action, text, who=context.who):
            if "name" in wanted and not item.run_name and _has_results(context.files(project), item.name, str(wanted["name"])):
                item.run_name = item.name
            for key, value in wanted.items():
                setattr(item, key, value)
            session.add(item)
        change = answered_change(context, session, project, item, infer=bool(wanted.keys() & {"category", "front", "crop"}))
    if "assignee" in wanted:
        context.hub.publish("projects", None)  # inbox counts are updated
    return after_change(context, change)


def refuse_overtaken(
    context: Context, session: Session, project: Project, item: SceneObject, body: schemas.ObjectPatch | schemas.UndoRequest
) -> None:
    """Raise Conflict, with the stored state, if the object was changed since the sender's version."""
    if body.version is None or body.version == item.version:
        return
    current = _shape_of(context, session, project, item).model_dump()
    raise Conflict(f"{item.name} was changed meanwhile", hint="look at what is stored now", current=current)


def delete(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Delete the object; undo restores it."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = _unlocked_row(session, project_id, object_id)
        with history.change(session, item, "prompts", "delete", f"deleted {item.name}", who=context.who):
            item.deleted = True
            session.add(item)
        change = answered_change(context, session, project, item, infer=True)
    return after_change(context, change)


def add_point(context: Context, project_id: str, object_id: int, body: schemas.PointIn, infer: bool) -> schemas.SceneObject:
    """Add one click."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = _unlocked_row(session, project_id, object_id)
        check_point(table_of(context, project), body.frame, body.x, body.y)
        text = f"{'+' if body.label else '-'} point on {item.name}, frame {body.frame}"
        with history.change(session, item, "prompts", "add point", text, who=context.who, frame=body.frame):
            session.add(Point(object_id=item.id or 0, **body.model_dump()))
        change = answered_change(context, session, project, item, infer)
    return after_change(context, change)


def add_points(context: Context, project_id: str, object_id: int, body: schemas.PointsIn, infer: bool) -> schemas.SceneObject:
    """Add several clicks as one change."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = _unlocked_row(session, project_id, object_id)
        table = table_of(context, project)
        for point in body.points:
            check_point(table, point.frame, point.x, point.y)
        frame = body.points[0].frame
        text = f"{len(body.points)} points on {item.name}, frame {frame}"
        with history.change(session, item, "prompts", "add points", text, who=context.who, frame=frame):
            session.add_all(Point(object_id=item.id or 0, **point.model_dump()) for point in body.points)
        change = answered_change(context, session, project, item, infer)
    return after_change(context, change)


def move_point(
    context: Context, project_id: str, object_id: int, point_id: int, body: schemas.PointPatch, infer: bool
) -> schemas.SceneObject:
    """Move a click or flip its label."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = _unlocked_row(session, project_id, object_id)
        point = _point(session, item, point_id)
        changes = body.model_dump(exclude_none=True)
        check_point(table_of(context, project), point.frame, changes.get("x", point.x), changes.get("y", point.y))
        text = f"moved a point of {item.name}, frame {point.frame}"
        with history.change(session, item, "prompts", "move point", text, who=context.who, frame=point.frame):
            point.sqlmodel_update(changes)
            session.add(point)
        change = answered_change(context, session, project, item, infer)
    return after_change(context, change)


def delete_point(context: Context, project_id: str, object_id: int, point_id: int, infer: bool) -> schemas.SceneObject:
    """Delete a click."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = _unlocked_row(session, project_id, object_id)
        point = _point(session, item, point_id)
        text = f"removed a point of {item.name}, frame {point.frame}"
        with history.change(session, item, "prompts", "remove point", text, who=context.who, frame=point.frame):
            session.delete(point)
        change = answered_change(context, session, project, item, infer)
    return after_change(context, change)


def say_of_frame(
    context: Context, project_id: str, object_id: int, frame: int, body: schemas.FrameIn | None
) -> schemas.SceneObject:
    """Correct an object in one frame; None removes the correction."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = _unlocked_row(session, project_id, object_id)
        if body is not None:  # a correction of a missing frame can still be removed
            check_said(table_of(context, project), item.name, frame, body.mask)
        others = {number: said for number, said in item.frames.items() if number != str(frame)}
        said = {} if body is None else {str(frame): body.mask.model_dump() if body.mask is not None else None}
        what = "as found" if body is None else "painted" if body.mask is not None else "not visible"
        text = f"{item.name} {what}, frame {frame}"
        with history.change(session, item, "prompts", "set frame", text, who=context.who, frame=frame):
            item.frames = others | said
            session.add(item)
        change = answered_change(context, session, project, item, infer=True)
    return after_change(context, change)


def segment(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Compute the object's masks now, even if they exist for these clicks."""
    masks.segment(context, project_id, object_id)
    return tell_object(context, project_id, object_id)


def segment_again(context: Context, project_id: str, object_id: int, key: str, others: list[int]) -> None:
    """Recompute the masks of these clicks after a change of other objects' clicks on its front, and publish it."""
    with reading(context.engine) as session:
        names = {item.id: item.name for item in queries.drawn(session, project_id)}
    if masks.segment_again(context, project_id, object_id, key):
        others_named = [names[number] for number in others if number in names]
        context.hub.publish("parted", project_id, name=names.get(object_id), others=others_named)
        tell_object(context, project_id, object_id)


def cancel_segment(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Stop computing the object's masks; existing ones are kept."""
    masks.cancel(context, project_id, object_id)
    return tell_object(context, project_id, object_id)


def create_in(context: Context, session: Session, project: Project, body: schemas.ObjectIn, what: str) -> SceneObject:
    for point in body.points:
        check_point(table_of(context, project), point.frame, point.x, point.y)
    category = body.category
    name = _free_name(session, project.id, category) if not body.name else _name(session, project.id, body.name, None)
    count = session.exec(select(func.count()).select_from(SceneObject).where(SceneObject.project_id == project.id)).one()
    item = SceneObject(project_id=project.id, name=name, category=category, colour=count, deleted=True)
    session.add(item)
    session.flush()
    frame = body.points[0].frame if body.points else None
    with history.change(session, item, "prompts", "create", f"{what} {name}", who=context.who, frame=frame):
        item.deleted = False
        item.front = body.front.model_dump() if body.front is not None else None
        session.add(item)
        session.add_all(Point(object_id=item.id or 0, **point.model_dump()) for point in body.points)
    return item


def require_usable(name: str) -> None:
    """Raise PromptError for a name that simulators or file systems do not accept."""
    if fault := name_fault(name):
        raise PromptError(f"the name '{name}' is not usable", hint=f"it {fault}; use a name such as {identifier(name)}")


def object_shape(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """One object as an API schema, including a deleted one."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id, deleted=True)
        return _shape_of(context, session, project, item)


def tell_object(context: Context, project_id: str, object_id: int) -> schemas.SceneObject:
    """Publish the object's state to all tabs."""
    with context.live.held():
        return _tell(context, object_shape(context, project_id, object_id))


def change_of(context: Context, session: Session, project: Project, item: SceneObject, infer: bool) -> Change:
    """The change of an object in the transaction; with `infer`, its masks will be recomputed."""
    shape = _shape_of(context, session, project, item)
    if infer:
        shape = _with_masks(shape, project, masks.state_after_follow(context, project, item))
    return Change(project, item, shape, infer)


def answered_change(context: Context, session: Session, project: Project, item: SceneObject, infer: bool) -> Change:
    """`change_of`, with its schema stored as the idempotent answer."""
    change = change_of(context, session, project, item, infer)
    once.keep_answer(session, change.shape.model_dump_json())
    return change


def after_changes(context: Context, changes: list[Change]) -> list[schemas.SceneObject]:
    """`after_change` of changes stored together; their interactions are resolved once, with the last."""
    return [after_change(context, change, tells=change is changes[-1]) for change in changes]


def after_change(context: Context, change: Change, *, tells: bool = True) -> schemas.SceneObject:
    """Follow-up of a stored change: recompute masks if requested, also dependent ones, and publish to all tabs."""
    if change.infer:
        masks.follow(context, change.project.id, change.shape.id, tells=tells)
    elif tells and context.live.runs(change.project.id):
        masks.tell_objects(context, change.project)
    with context.live.held():
        now = masks.state_of(context, change.project, change.item)
        return _tell(context, _with_masks(change.shape, change.project, now))


def _tell(context: Context, shape: schemas.SceneObject) -> schemas.SceneObject:
    context.hub.publish_state("object", shape.project, shape.id, shape.version, object=shape.model_dump())
    return shape


def _shape_of(context: Context, session: Session, project: Project, item: SceneObject) -> schemas.SceneObject:
    steps, saved = history.steps_and_saved(session, item, "prompts")
    return _shape(context, project, item, queries.clicks_of(session, item.id), steps, saved)


def _shape(
    context: Context,
    project: Project,
    item: SceneObject,
    clicks: list[queries.Click],
    steps: history.Steps,
    saved: float,
    places: masks.Places | None = None,
) -> schemas.SceneObject:
    shape = schemas.SceneObject(
        id=item.id or 0,
        project=item.project_id,
        name=item.name,
        category=item.category,
        colour=item.colour,
        version=item.version,
        deleted=item.deleted,
        points=[schemas.Point(id=p.id or 0, frame=p.frame, x=p.x, y=p.y, label=1 if p.label else 0) for p in clicks],
        assignee=item.assignee,
        locked_by=item.locked_by,
        can_undo=steps.undo,
        can_redo=steps.redo,
        front=schemas.PromptsFileFront.model_validate(readable_front(item.front)) if item.front is not None else None,
        frames=[
            schemas.FrameSaid(frame=int(number), visible=mask is not None)
            for number, mask in sorted(item.frames.items(), key=lambda one: int(one[0]))
        ],
        crop=schemas.PromptsFileCrop.model_validate(item.crop) if item.crop is not None else None,
        segment="none",
        mask_frames=0,
        mask_backend="",
        notices=[],
        doubts=[],
        certainty=None,
        suggested="",
        saved=saved,
    )
    return _with_masks(shape, project, masks.state_of(context, project, item, places))


def _with_masks(shape: schemas.SceneObject, project: Project, now: masks.MasksState) -> schemas.SceneObject:
    """The schema with the given mask state."""
    told: dict[str, object] = {"segment": now.state, "mask_frames": now.frames, "doubts": [*now.doubts]}
    told |= {"certainty": now.certainty, "suggested": now.suggested, "mask_backend": project.segmenter if now.frames else ""}
    return shape.model_copy(update=told | {"notices": [*now.notices, *_category_notice(shape.category)]})


def _wanted(context: Context, session: Session, item: SceneObject, body: schemas.ObjectPatch) -> dict[str, object]:
    """Validated changes of a patch."""
    wanted: dict[str, object] = {}
    if body.name is not None and body.name != item.name:
        wanted["name"] = _name(session, item.project_id, body.name, item.id)
    if body.category is not None and body.category != item.category:
        wanted["category"] = body.category
    if body.colour is not None and body.colour != item.colour:
        wanted["colour"] = body.colour
    for key, drawn in (("front", body.front), ("crop", body.crop)):
        value = drawn.model_dump() if drawn is not None else None
        if key in body.model_fields_set and value != getattr(item, key):
            wanted[key] = value
    if "assignee" in body.model_fields_set:
        name = assigning.require_name(context, session, item.project_id, body.assignee) if body.assignee else None
        wanted |= {"assignee": name} if name != item.assignee else {}
    if body.locked is not None and body.locked == (item.locked_by is None):
        wanted["locked_by"] = context.who if body.locked else None
    return wanted


def _has_results(files: ProjectFiles, *names: str) -> bool:
    """Whether a run has stored results under one of these names, which must stay with their object."""
    return any(noun_path(files.work, "segment", name).is_file() for name in names)


def _said_of(item: SceneObject, key: str, value: object) -> str:
    """Description of a field's change."""
    if key == "assignee":
        return f"{item.name} assigned to {value or 'nobody'}"
    if key == "locked_by":
        return f"{item.name} {'locked' if value else 'unlocked'}"
    if key == "crop":
        return f"crop box of {item.name} {'set' if value is not None else 'taken away'}"
    if key != "front":
        return f"{key} of {item.name} → {value}"
    return f"front of {item.name} {'drawn' if value is not None else 'as found'}"


def _gives_masks(body: schemas.ObjectIn) -> bool:
    return bool(body.points) or body.front is not None


def _unlocked_row(session: Session, project_id: str, object_id: int) -> SceneObject:
    """The row of an object that may be changed."""
    item = queries.object_row(session, project_id, object_id)
    _refuse_locked(item)
    return item


def _refuse_locked(item: SceneObject) -> None:
    """Raise Conflict for a locked object."""
    if item.locked_by is not None:
        raise Conflict(f"{item.name} is locked by {item.locked_by}", hint="unlock it in the list of objects to change it")


def _point(session: Session, item: SceneObject, point_id: int) -> Point:
    found = session.get(Point, point_id)
    if found is None or found.object_id != item.id:
        raise NotFound(f"no point {point_id} on {item.name}", hint="it may have been removed in the meantime")
    return found


def _name(session: Session, project_id: str, name: str, mine: int | None) -> str:
    """The name, validated for simulators and uniqueness."""
    require_usable(name)
    if name.casefold() in _names(session, project_id, mine):
        raise PromptError(f"two objects named '{name}'", hint="names are unique: choose another one")
    return name


def _free_name(session: Session, project_id: str, category: str) -> str:
    stem = identifier(category)
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
