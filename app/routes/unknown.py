"""Files found in the data folder without a database row."""

from fastapi import APIRouter

from app import schemas
from app.deps import AdminCtx
from app.services import unknown

router = APIRouter(prefix="/api/unknown", tags=["unknown"])


@router.get("", operation_id="listUnknown")
def list_unknown(context: AdminCtx) -> list[schemas.UnknownFolder]:
    """Folders set aside because they are not in the database."""
    return unknown.everything(context)


@router.post("/{entry}/adopt", operation_id="adoptUnknown")
async def adopt_unknown(context: AdminCtx, entry: str) -> schemas.Project:
    """Restore a folder as a project, with its clicks, verdicts, corrections, comments, recording and bundles."""
    return await context.gates.looks.run(context.who, unknown.adopt, context, entry)


@router.post("/{entry}/leave", operation_id="leaveUnknown")
def leave_unknown(context: AdminCtx, entry: str) -> schemas.UnknownFolder:
    """Leave a folder where it is; it is then listed as left in place."""
    return unknown.leave(context, entry)


@router.post("/{entry}/discard", operation_id="discardUnknown", status_code=204)
def discard_unknown(context: AdminCtx, entry: str) -> None:
    """Delete the bytes of an upload."""
    unknown.discard(context, entry)
