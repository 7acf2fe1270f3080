"""Objects proposed without a click."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.services import proposals

router = APIRouter(prefix="/api/projects/{project}/proposals", tags=["proposals"])


@router.get("", operation_id="getProposals")
def get_proposals(context: Ctx, project: str) -> schemas.Proposals:
    """The current proposals, most confident first."""
    return proposals.current(context, project)


@router.post("/confirm", operation_id="confirmProposals", status_code=201)
def confirm_proposals(context: Ctx, project: str, body: schemas.ProposalsConfirmed) -> list[schemas.SceneObject]:
    """Make objects of the proposals; undo removes each."""
    return proposals.confirm(context, project, body.ids, body.category)


@router.post("/dismiss", operation_id="dismissProposals")
def dismiss_proposals(context: Ctx, project: str, body: schemas.ProposalIds) -> schemas.Proposals:
    """Dismiss the proposals."""
    return proposals.dismiss(context, project, body.ids)


@router.post("/restore", operation_id="restoreProposals")
def restore_proposals(context: Ctx, project: str) -> schemas.Proposals:
    """Bring back all dismissed proposals."""
    return proposals.restore(context, project)
