"""True lengths measured in the room."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.routes.numbers import RowId
from app.services import lengths

router = APIRouter(prefix="/api/projects/{project}/lengths", tags=["reviews"])


@router.get("", operation_id="listLengths")
def list_lengths(context: Ctx, project: str) -> schemas.TrueLengths:
    """Every true length beside the length in the scan, and the scale that fits them best."""
    return lengths.list_lengths(context, project)


@router.post("", operation_id="addLength", status_code=201)
def add_length(context: Ctx, project: str, body: schemas.TrueLengthIn) -> schemas.TrueLengths:
    """Store a length measured with a tape."""
    return lengths.add(context, project, body)


@router.delete("/{length}", operation_id="removeLength")
def remove_length(context: Ctx, project: str, length: RowId) -> schemas.TrueLengths:
    """Delete a true length."""
    return lengths.remove(context, project, length)
