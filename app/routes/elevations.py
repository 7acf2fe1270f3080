"""Planes of the scan on which fronts are drawn, and the fronts found so far."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.services import elevations

router = APIRouter(prefix="/api/projects/{project}/elevations", tags=["elevations"])


@router.get("", operation_id="getElevations")
def get_elevations(context: Ctx, project: str) -> schemas.Elevations:
    """Elevations with the line evidence that edges snap to; none until the live segmenter has rendered them."""
    return elevations.current(context, project)


@router.get("/fronts", operation_id="getFoundFronts")
def get_found_fronts(context: Ctx, project: str) -> list[schemas.FoundFront]:
    """The flat fronts of the objects whose masks are done."""
    return elevations.found_fronts(context, project)
