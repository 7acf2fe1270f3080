"""What lay in the data folder and no row knew of."""

from fastapi import APIRouter

from app import schemas
from app.deps import AdminCtx
from app.services import unknown

router = APIRouter(prefix="/api/unknown", tags=["unknown"])


@router.get("", operation_id="listUnknown")
def list_unknown(context: AdminCtx) -> list[schemas.UnknownFolder]:
    """What was set aside because the database does not know it."""
    return unknown.everything(context)


@router.post("/{entry}/adopt", operation_id="adoptUnknown")
def adopt_unknown(context: AdminCtx, entry: str) -> schemas.Project:
    """Make it a project again, with its clicks, verdicts, corrections, comments, recording and bundles."""
    return unknown.adopt(context, entry)


@router.post("/{entry}/leave", operation_id="leaveUnknown")
def leave_unknown(context: AdminCtx, entry: str) -> schemas.UnknownFolder:
    """Leave it where it is; it is shown as left."""
    return unknown.leave(context, entry)
