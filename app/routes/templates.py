"""Templates of names and categories, and checklists made from them."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.routes.numbers import RowId
from app.services import templates

router = APIRouter(prefix="/api", tags=["projects"])


@router.get("/templates", operation_id="listTemplates")
def list_templates(context: Ctx) -> list[schemas.Template]:
    """Lists of objects to click, of all people of the server, by name."""
    return templates.listed(context)


@router.post("/templates", operation_id="addTemplate", status_code=201)
def add_template(context: Ctx, body: schemas.TemplateIn) -> schemas.Template:
    """A new one; 409 when the name is taken."""
    return templates.add(context, body)


@router.put("/templates/{template}", operation_id="changeTemplate")
def change_template(context: Ctx, template: RowId, body: schemas.TemplateIn) -> schemas.Template:
    """Another name or other objects, from now on; 403 unless yours, or you are an admin."""
    return templates.change(context, template, body)


@router.delete("/templates/{template}", operation_id="removeTemplate", status_code=204)
def remove_template(context: Ctx, template: RowId) -> None:
    """Projects that took it over keep what they took; 403 unless yours, or you are an admin."""
    templates.remove(context, template)


@router.put("/projects/{project}/checklist", operation_id="setChecklist")
def set_checklist(context: Ctx, project: str, body: schemas.ChecklistIn) -> schemas.Project:
    """The objects of a template are to be clicked in the project from now on, or none are listed."""
    return templates.set_checklist(context, project, body)
