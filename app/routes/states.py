"""Review states, comments, and effort spent on a project."""

from fastapi import APIRouter
from fastapi.responses import Response

from app import schemas
from app.deps import Ctx
from app.routes.numbers import RowId
from app.services import comments, effort, states

router = APIRouter(prefix="/api/projects/{project}", tags=["reviews"])


@router.get("/review", operation_id="getReview")
def get_review(context: Ctx, project: str) -> schemas.ReviewStatus:
    """The project's state, and its possible next states with the open conditions of each."""
    return states.status(context, project)


@router.post("/review", operation_id="stepReview")
def step_review(context: Ctx, project: str, body: schemas.ReviewStep) -> schemas.ReviewStatus:
    """Change the state; 409 for an impossible change, or for open conditions without a reason."""
    return states.step(context, project, body)


@router.get("/figures", operation_id="getFigures")
def get_figures(context: Ctx, project: str) -> schemas.Figures:
    """Clicks per object, fraction of automatic choices kept, time from upload to approval."""
    return states.figures(context, project)


@router.get("/effort.csv", operation_id="getEffort", response_class=Response)
async def get_effort(context: Ctx, project: str) -> Response:
    """Clicks, verdicts, comments and minutes of each person on each object, as a table to download.

    For admins, a honeypot's table also gives the true object of each row.
    """
    text = await context.gates.looks.run(context.who, effort.table, context, project)
    headers = {"content-disposition": f'attachment; filename="effort-{project}.csv"', "cache-control": "no-store"}
    return Response(text, media_type="text/csv; charset=utf-8", headers=headers)


@router.get("/comments", operation_id="listComments")
def list_comments(context: Ctx, project: str) -> list[schemas.Comment]:
    """All comments, oldest first."""
    return comments.list_comments(context, project)


@router.post("/comments", operation_id="addComment", status_code=201)
def add_comment(context: Ctx, project: str, body: schemas.CommentIn) -> schemas.Comment:
    """Comment on the project, an object, a pixel of a frame or a point of the scene."""
    return comments.add(context, project, body)


@router.patch("/comments/{comment}", operation_id="changeComment")
def change_comment(context: Ctx, project: str, comment: RowId, body: schemas.CommentPatch) -> schemas.Comment:
    """Resolve a comment, or open it again."""
    return comments.change(context, project, comment, body)
