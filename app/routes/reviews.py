"""Candidates, verdicts and corrections."""

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request

from app import schemas
from app.deps import Ctx, ReviewerCtx
from app.routes.numbers import STREAMED, RowId
from app.services import differences, mesh_uploads, overlays, reviews

Name = Annotated[str, Path(max_length=200)]
Candidate = Annotated[str, Query(max_length=200)]
Version = Annotated[int | None, Query(ge=0)]

router = APIRouter(prefix="/api/projects/{project}", tags=["reviews"])


@router.get("/candidates", operation_id="listCandidates")
def list_candidates(context: Ctx, project: str) -> list[schemas.CandidateGroup]:
    """Every object's candidates with their evidence."""
    return reviews.groups(context, project)


@router.get("/objects/{object}/candidates", operation_id="getCandidates")
def get_candidates(context: Ctx, project: str, object: RowId) -> schemas.CandidateGroup:
    """One object's candidates; 409 while there are none."""
    return reviews.group(context, project, object)


@router.get("/objects/{object}/differences", operation_id="getDifferences")
async def get_differences(context: Ctx, project: str, object: RowId, against: Candidate) -> schemas.Differences:
    """Distance of every candidate from `against`, and the crops they were made from."""
    return await context.gates.views.run(context.who, differences.differences, context, project, object, against)


@router.post("/objects/{object}/candidates", operation_id="uploadCandidate", status_code=201, max_body_size=STREAMED)
async def upload_candidate(
    context: ReviewerCtx,
    request: Request,
    project: str,
    object: RowId,
    filename: str,
    rerun: bool = True,
    version: Version = None,
) -> schemas.Reviewed:
    """A mesh (the request's body: GLB, OBJ, PLY or STL) as this object's candidate, chosen by a person."""
    return await mesh_uploads.upload(context, project, object, filename, request.stream(), rerun, version)


@router.post("/objects/{object}/mesh-look", operation_id="lookAtMesh", max_body_size=STREAMED)
async def look_at_mesh(context: ReviewerCtx, request: Request, project: str, object: RowId, filename: str) -> schemas.MeshLook:
    """Preview of a mesh (the request's body: GLB, OBJ, PLY or STL) as a candidate; nothing is stored."""
    return await mesh_uploads.look(context, project, object, filename, request.stream())


@router.patch("/scene/{name}/override", operation_id="correctMade")
def correct_made(context: ReviewerCtx, project: str, name: Name, body: schemas.OverridePatch) -> schemas.Reviewed:
    """Correct a worktop or plinth that was made from the scan; what depends on it runs again."""
    return reviews.correct_made(context, project, name, body)


@router.post("/objects/{object}/verdicts", operation_id="giveVerdict")
def give_verdict(context: ReviewerCtx, project: str, object: RowId, body: schemas.VerdictIn) -> schemas.Reviewed:
    """Accept, reject or clear; undo with scope `review`. 409 with both versions when `version` is old."""
    return reviews.give_verdict(context, project, object, body)


@router.get("/objects/{object}/override", operation_id="getOverride")
def get_override(context: Ctx, project: str, object: RowId) -> schemas.OverrideData:
    """The corrections of the object."""
    return reviews.get_override(context, project, object)


@router.patch("/objects/{object}/override", operation_id="setOverride")
def set_override(context: ReviewerCtx, project: str, object: RowId, body: schemas.OverridePatch) -> schemas.Reviewed:
    """Correct the object; what depends on it runs again. 409 with both versions when `version` is old."""
    return reviews.set_override(context, project, object, body)


@router.get("/objects/{object}/photos", operation_id="getPhotos")
def get_photos(context: Ctx, project: str, object: RowId) -> schemas.ObjectPhotos:
    """The frames to check an object on, with their cameras, and what can be laid over them."""
    return overlays.photos(context, project, object)
