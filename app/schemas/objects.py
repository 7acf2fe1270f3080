"""Objects, clicks, undo and history."""

from typing import Literal

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.text import Word
from r2c2r_core.schema.prompts import PromptsFileCrop, PromptsFileFront, PromptsFileMask

SegmentState = Literal["none", "waiting", "running", "partial", "done", "failed"]


class PointIn(Shape):
    """A click. Outside the frame is refused."""

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
    """A frame in which a person set an object right."""

    frame: int
    visible: bool


class ObjectIn(Shape):
    """A new object; without a name it gets its category's and the next number."""

    name: Word | None = None
    category: Word = "object"
    points: list[PointIn] = Field(default_factory=list, max_length=100)
    front: PromptsFileFront | None = None  # drawn in its elevation


class ObjectPatch(Shape):
    """Changes of an object; a drawn front, a crop box and the assignee can also be removed.

    With `version`, only if nobody changed it meanwhile.
    """

    name: Word | None = None
    category: Word | None = None
    colour: int | None = Field(default=None, ge=0, le=999)
    front: PromptsFileFront | None = None
    crop: PromptsFileCrop | None = None
    assignee: Word | None = None
    version: int | None = None


class SceneObject(Shape):
    """One object a person named."""

    id: int
    project: str
    name: str
    category: str
    colour: int
    version: int
    deleted: bool
    points: list[Point]
    front: PromptsFileFront | None  # drawn; None: what the clicks find
    frames: list[FrameSaid]  # set right by a person
    crop: PromptsFileCrop | None  # a box that it lies in, drawn by a person
    assignee: str | None  # whose turn it is
    can_undo: bool
    can_redo: bool
    segment: SegmentState
    mask_frames: int
    mask_backend: str  # the segmenter that drew the masks; empty while there are none
    notices: list[str]
    doubts: list[str]  # about its front: a size or a place that its category does not have, edges that hardly show
    saved: float  # when the last change was stored


class UndoRequest(Shape):
    """Target of an undo or redo: the last change of this object, or of any object when None."""

    object: int | None = Field(default=None, ge=0, lt=2**63)
    scope: Literal["prompts", "review"] = "prompts"
    version: int | None = Field(default=None, ge=0)  # of it in this scope, as last seen: 409 when somebody changed it since


class Undone(Shape):
    """The undone or redone change, for display."""

    object: SceneObject
    text: str
    frame: int | None
    version: int  # of the object in this scope by now


class HistoryEntry(Shape):
    """Who changed what, when."""

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
    frames: int  # that they come from
    centre_m: list[float]  # world
    size_m: list[float]  # of the box around most of them, along the world's axes
    around: PromptsFileCrop | None  # that box, a little larger, as a crop box; None without points
    xyz_mm: str  # base64 of int16, little endian, three a point
    rgb: str  # base64 of bytes, three a point
