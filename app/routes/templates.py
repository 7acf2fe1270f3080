"""Templates of names and categories, and checklists made from them."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.routes.numbers import RowId
from app.services import templates

router = APIRouter(prefix="/api", tags=["projects"])


@router.get("/templates", operation_id="listTemplates")
def list_templates(context: Ctx) -> list[schemas.Template]:
    """Lists of objects to click, shared by everybody on the server, by name."""
    return templates.listed(context)


@router.post("/templates", operation_id="addTemplate", status_code=201)
def add_template(context: Ctx, body: schemas.TemplateIn) -> schemas.Template:
    """Add a template; 409 when the name is taken."""
    return templates.add(context, body)


@router.put("/templates/{template}", operation_id="changeTemplate")
def change_template(context: Ctx, template: RowId, body: schemas.TemplateIn) -> schemas.Template:
    """Change a template's name or objects; 403 unless it is yours or you are an admin."""
    return templates.change(context, template, body)


@router.delete("/templates/{template}", operation_id="removeTemplate", status_code=204)
def remove_template(context: Ctx, template: RowId) -> None:
    """Delete a template; existing checklists are unchanged. 403 unless it is yours or you are an admin."""
    templates.remove(context, template)


@router.put("/projects/{project}/checklist", operation_id="setChecklist")
def set_checklist(context: Ctx, project: str, body: schemas.ChecklistIn) -> schemas.Project:
    """Use the objects of a template as the project's list of objects to click, or clear that list."""
    return templates.set_checklist(context, project, body)
