"""Templates of names and categories, and checklists of projects made from them."""

import time

from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Event, Template
from app.errors import Conflict, Forbidden, NotFound
from app.services import projects
from app.services.context import Context
from app.services.prompts import require_usable
from r2c2r_core.errors import InputError

MOST = 200  # on a server


def listed(context: Context) -> list[schemas.Template]:
    """All templates, by name."""
    with reading(context.engine) as session:
        return [_shape(context, row) for row in session.exec(select(Template).order_by(col(Template.name)))]


def add(context: Context, body: schemas.TemplateIn) -> schemas.Template:
    """Add a template; raises Conflict when the name is taken."""
    with writing(context.engine) as session:
        if len(session.exec(select(Template.id)).all()) >= MOST:
            raise InputError(f"there are already {MOST} templates", hint="delete unused ones")
        return _write(context, session, Template(name="", who=context.who, changed=0.0), body)


def change(context: Context, number: int, body: schemas.TemplateIn) -> schemas.Template:
    """Change name or objects; existing checklists are unchanged. Only by its author or an admin."""
    with writing(context.engine) as session:
        return _write(context, session, _mine(context, session, number), body)


def remove(context: Context, number: int) -> None:
    """Delete a template; existing checklists are unchanged. Only by its author or an admin."""
    with writing(context.engine) as session:
        session.delete(_mine(context, session, number))


def set_checklist(context: Context, project_id: str, body: schemas.ChecklistIn) -> schemas.Project:
    """Set the project's checklist from a template, or clear it."""
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        template = _row(session, body.template) if body.template is not None else None
        wanted = template.objects if template else []
        text = (
            f"{len(wanted)} objects to click, from the template {template.name}" if template else "no list of objects to click"
        )
        if wanted != project.checklist:
            event = Event(
                project_id=project.id, scope="project", action="checklist", text=text, who=context.who, at=time.time()
            )
            event.before, event.after = {"checklist": project.checklist}, {"checklist": wanted}
            project.checklist, project.updated = [dict(entry) for entry in wanted], event.at
            session.add_all([project, event])
    projects.tell(context, project_id)
    return projects.get_project(context, project_id)


def _write(context: Context, session: Session, row: Template, body: schemas.TemplateIn) -> schemas.Template:
    _check(body.objects)
    same = select(Template.id).where(Template.name == body.name, col(Template.id).is_distinct_from(row.id))
    if session.exec(same).first() is not None:
        raise Conflict(f"the template {body.name} already exists", hint="choose another name, or change that one")
    row.name, row.objects = body.name, [entry.model_dump() for entry in body.objects]
    row.changed = time.time()
    session.add(row)
    session.flush()
    return _shape(context, row)


def _check(objects: list[schemas.ListedObject]) -> None:
    """Raise PromptError or InputError for invalid object names."""
    seen: set[str] = set()
    for entry in objects:
        require_usable(entry.name)
        if entry.name.casefold() in seen:
            raise InputError(f"two objects named '{entry.name}'", hint="names are unique: choose another one")
        seen.add(entry.name.casefold())


def _row(session: Session, number: int) -> Template:
    row = session.get(Template, number)
    if row is None:
        raise NotFound(f"no template {number}", hint="it may have been deleted; look at the list again")
    return row


def _mine(context: Context, session: Session, number: int) -> Template:
    row = _row(session, number)
    if not _may_change(context, row):
        raise Forbidden(f"the template {row.name} belongs to {row.who}", hint="ask them or an admin, or make your own")
    return row


def _may_change(context: Context, row: Template) -> bool:
    return row.who == context.who or context.person.may("admin")


def _shape(context: Context, row: Template) -> schemas.Template:
    objects = [schemas.ListedObject(**entry) for entry in row.objects]
    may = _may_change(context, row)
    return schemas.Template(id=row.id or 0, name=row.name, objects=objects, who=row.who, changed=row.changed, may_change=may)
