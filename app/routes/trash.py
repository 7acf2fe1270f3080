"""The trash: deleted projects, until they are restored or permanently deleted."""

from fastapi import APIRouter

from app import schemas
from app.deps import AdminCtx
from app.services import trash

router = APIRouter(prefix="/api/trash", tags=["trash"])


@router.get("", operation_id="listTrash")
def list_trash(context: AdminCtx) -> list[schemas.Trashed]:
    """The projects in the trash, newest first."""
    return trash.everything(context)


@router.post("/{entry}/restore", operation_id="restoreProject")
def restore_project(context: AdminCtx, entry: str) -> schemas.Project:
    """Restore the project from the trash."""
    return trash.restore(context, entry)


@router.delete("/{entry}", operation_id="deleteForGood")
async def delete_for_good(context: AdminCtx, entry: str) -> schemas.Deleted:
    """Delete the project and its files for good; a recording imported by path stays where it is."""
    return await context.gates.deletions.run(context.who, trash.delete, context, entry)
