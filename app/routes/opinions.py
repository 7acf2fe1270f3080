"""Second opinions, and how far they agree."""

from fastapi import APIRouter
from fastapi.responses import Response

from app import schemas
from app.deps import Ctx
from app.services import opinions

router = APIRouter(prefix="/api/projects/{project}/opinions", tags=["people"])


@router.get("", operation_id="listOpinions")
def list_opinions(context: Ctx, project: str) -> list[schemas.Opinion]:
    """Second opinions: other projects on the same recording."""
    return opinions.listed(context, project)


@router.post("", operation_id="askOpinion", status_code=201)
async def ask_opinion(context: Ctx, project: str, body: schemas.OpinionIn) -> schemas.Project:
    """Make a copy of the recording without objects for a second opinion; 409 while a job of the project is running."""
    return await context.gates.looks.run(context.who, opinions.ask, context, project, body)


@router.get("/{other}", operation_id="getAgreement")
async def get_agreement(context: Ctx, project: str, other: str) -> schemas.Agreement:
    """Objects in both projects, with mask IoU and categories, and objects in only one of them."""
    return await context.gates.looks.run(context.who, opinions.agreement, context, project, other)


@router.get("/{other}/agreement.csv", operation_id="getAgreementTable", response_class=Response)
async def get_agreement_table(context: Ctx, project: str, other: str) -> Response:
    """The same as a table to download."""
    text = await context.gates.looks.run(context.who, opinions.table, context, project, other)
    headers = {"content-disposition": f'attachment; filename="agreement-{project}.csv"', "cache-control": "no-store"}
    return Response(text, media_type="text/csv; charset=utf-8", headers=headers)
