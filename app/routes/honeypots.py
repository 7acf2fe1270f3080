"""Honeypots, for admins only."""

from fastapi import APIRouter

from app import schemas
from app.deps import AdminCtx
from app.services import honeypots

router = APIRouter(prefix="/api", tags=["people"])


@router.get("/honeypots", operation_id="listHoneypots")
def list_honeypots(context: AdminCtx) -> list[schemas.Honeypot]:
    """Sample kitchens in people's queues (honeypots), the newest first."""
    return honeypots.listed(context)


@router.post("/projects/{project}/honeypot", operation_id="slipHoneypot", status_code=201)
async def slip_honeypot(context: AdminCtx, project: str, body: schemas.HoneypotIn) -> schemas.Honeypot:
    """Put the recording of a sample kitchen into a person's queue; 409 for a project without known ground truth."""
    return await context.gates.looks.run(context.who, honeypots.slip, context, project, body)


@router.get("/projects/{project}/honeypot", operation_id="scoreHoneypot")
async def score_honeypot(context: AdminCtx, project: str) -> schemas.HoneypotScore:
    """Objects found, mask IoU and categories, compared with the ground truth."""
    return await context.gates.looks.run(context.who, honeypots.score, context, project)
