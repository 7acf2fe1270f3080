"""Review states, comments, and effort spent on a project."""

from typing import Literal, Self

from pydantic import Field, model_validator

from app.schemas.base import Shape
from app.schemas.text import Prose, Remark
from app.schemas.viewer import ViewerLook

ReviewState = Literal["draft", "ready", "in review", "changes requested", "approved"]


class ReviewMove(Shape):
    """One permitted step; with unmet conditions it needs a written reason, which is stored in the history."""

    to: ReviewState
    text: str  # label of its button
    role: Literal["annotator", "reviewer"]
    unmet: list[str]
    notes: list[str]  # points to check before; they do not prevent the step
    needs_reason: bool


class ReviewStatus(Shape):
    """The review state with its author, and the possible next steps."""

    state: ReviewState
    who: str
    at: float | None
    reason: str
    moves: list[ReviewMove]


class ReviewStep(Shape):
    """A requested step; refused if the project is no longer in `from_state`."""

    from_state: ReviewState
    to: ReviewState
    reason: Remark = ""


class CommentPin(Shape):
    """Position of a comment: a pixel of a frame, a point of the scene (world, metres), or neither."""

    object: int | None = Field(default=None, ge=0, lt=2**63)
    frame: int | None = Field(default=None, ge=0, lt=2**31)
    x: float | None = Field(default=None, allow_inf_nan=False)
    y: float | None = Field(default=None, allow_inf_nan=False)
    point_world: tuple[float, float, float] | None = None
    view: ViewerLook | None = None  # settings and camera of the 3D view


class CommentIn(CommentPin):
    """A new comment."""

    text: Prose

    @model_validator(mode="after")
    def _pinned_whole(self) -> Self:
        """Require a frame and both coordinates for a pixel, and finite coordinates for a point."""
        given = [value is not None for value in (self.frame, self.x, self.y)]
        if any(given) and not all(given):
            raise ValueError("a pin on a frame needs frame, x and y")
        if self.point_world is not None and not all(abs(value) < 1e6 for value in self.point_world):
            raise ValueError("a pin in the scene needs three finite metres")
        return self


class CommentPatch(Shape):
    """Resolve a comment, or open it again."""

    resolved: bool


class Comment(CommentPin):
    """A comment with its position, and whether it is resolved."""

    id: int
    text: str
    who: str
    at: float
    resolved_by: str
    resolved_at: float | None


class Figures(Shape):
    """Effort spent on the project so far; times in seconds."""

    objects: int
    clicks: int  # points set, moved, removed; proposals confirmed, dismissed; objects edited, deleted; undos: one each
    clicks_per_object: float | None
    verdicts: int  # verdicts and corrections
    automatic_kept: float | None  # fraction of accepted candidates that were the automatic choice
    upload_to_approval_s: float | None  # from the start of the upload, or of the import without one
    computing_s: float  # of import, proposals, masks and runs; overlapping times count once
    age_s: float
