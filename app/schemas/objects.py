"""Objects, clicks, undo and history."""

from typing import Literal

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.text import Word
from r2c2r_core.schema.prompts import PromptsFileCrop, PromptsFileFront, PromptsFileMask

SegmentState = Literal["none", "waiting", "running", "partial", "done", "failed"]


class PointIn(Shape):
    """A click; refused outside the frame."""

    frame: int = Field(ge=0, lt=2**31)
    x: float = Field(allow_inf_nan=False)
    y: float = Field(allow_inf_nan=False)
    label: Literal[0, 1] = 1


class PointsIn(Shape):
    """Clicks that belong together: one change, one undo."""

    points: list[PointIn] = Field(min_length=1, max_length=100)


class PointPatch(Shape):
    """A moved or flipped click."""

    x: float | None = Field(default=None, allow_inf_nan=False)
    y: float | None = Field(default=None, allow_inf_nan=False)
    label: Literal[0, 1] | None = None


class Point(Shape):
    """A stored click."""

    id: int
    frame: int
    x: float
    y: float
    label: Literal[0, 1]


class FrameIn(Shape):
    """Correction of an object in one frame: a fixed mask, or None: not visible there."""

    mask: PromptsFileMask | None


class FrameSaid(Shape):
    """A frame in which a user corrected the object."""

    frame: int
    visible: bool


class ObjectIn(Shape):
    """A new object; without a name it gets its category and the next number."""

    name: Word | None = None
    category: Word = "object"
    points: list[PointIn] = Field(default_factory=list, max_length=100)
    front: PromptsFileFront | None = None  # drawn in its elevation


class ObjectPatch(Shape):
    """Changes of an object; a drawn front, a crop box and the assignee can also be removed.

    With `version`, refused if it was changed since that version.
    """

    name: Word | None = None
    category: Word | None = None
    colour: int | None = Field(default=None, ge=0, le=999)
    front: PromptsFileFront | None = None
    crop: PromptsFileCrop | None = None
    assignee: Word | None = None
    locked: bool | None = None  # against changes by anybody, until somebody unlocks it
    version: int | None = None


class SceneObject(Shape):
    """One annotated object."""

    id: int
    project: str
    name: str
    category: str
    colour: int
    version: int
    deleted: bool
    points: list[Point]
    front: PromptsFileFront | None  # drawn; None: detected from the clicks
    frames: list[FrameSaid]  # corrected by a user
    crop: PromptsFileCrop | None  # bounding box drawn by a user
    assignee: str | None  # current assignee
    locked_by: str | None  # the user who locked it against changes
    can_undo: bool
    can_redo: bool
    segment: SegmentState
    mask_frames: int
    mask_backend: str  # segmenter of the masks; empty without any
    notices: list[str]
    doubts: list[str]  # about its front: implausible size or position for its category, weak edges
    certainty: float | None  # probability that its front is right, 0..1; None without a front
    suggested: str  # category that its front suggests, if its size is unlikely for its own; empty otherwise
    saved: float  # time of the last stored change


class UndoRequest(Shape):
    """Target of an undo or redo: the last change of this object, or this person's last one of any object when None."""

    object: int | None = Field(default=None, ge=0, lt=2**63)
    scope: Literal["prompts", "review"] = "prompts"
    version: int | None = Field(default=None, ge=0)  # of the object in this scope, as last seen: 409 if it was changed since


class Undone(Shape):
    """The undone or redone change, for display."""

    object: SceneObject
    text: str
    frame: int | None
    version: int  # current, of the object in this scope


class HistoryEntry(Shape):
    """One change with its author and time."""

    id: int
    object: int | None
    scope: str
    action: str
    text: str
    frame: int | None
    who: str
    at: float
    undone: bool


class ObjectPoints(Shape):
    """An object's shape from masks and depth: points around their centre, +Z up."""

    count: int
    frames: int  # number of frames they come from
    centre_m: list[float]  # world
    size_m: list[float]  # of the box around most of them, along the world axes
    around: PromptsFileCrop | None  # that box, a little larger, as a crop box; None without points
    xyz_mm: str  # base64 of int16, little endian, three per point
    rgb: str  # base64 of bytes, three per point
