"""What the 3D view shows."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from app.schemas.base import Shape
from app.schemas.text import Word


class ViewerSession(Shape):
    """Where the 3D view of a project is; `fallback` when it is down."""

    state: Literal["ready", "down"]
    url: str | None  # for the iframe, ends in a slash
    message: str
    fallback_page: str | None  # the bundle's own 3D page
    fallback_image: str | None


Row = Annotated[list[Annotated[float, Field(ge=-1e4, le=1e4)]], Field(min_length=4, max_length=4)]
Pose = Annotated[list[Row], Field(min_length=4, max_length=4)]
Side = Annotated[float, Field(gt=0, le=100)]


class ViewerBox(Shape):
    """The box of an object that is to be moved by hand."""

    pose: Pose  # world_from_object
    size: tuple[Side, Side, Side]  # width, depth, height in metres


class ViewerPlace(Shape):
    """Where to put the object that is moved by hand, world_from_object; null leaves it where it is."""

    pose: Pose | None


class ViewerPlaced(Shape):
    """Where the object that is moved by hand is, world_from_object; null when none is."""

    pose: list[list[float]] | None


class ViewerShow(Shape):
    """What the 3D view shows."""

    mode: Literal["cloud", "candidate", "aligned", "scene"]
    object: int | None = Field(default=None, ge=0, lt=2**63)
    candidate: Word | None = None
    cloud: bool = True  # the scan behind it
    opacity: float = Field(default=1.0, ge=0.0, le=1.0)
    collision: bool = False  # colliders instead of what is seen (scene only)
    box: ViewerBox | None = None  # with handles to move it by (aligned only, with an object)
    full: bool = False  # every point and face, whatever it costs
    look: Literal["object", "scene"] | None = None  # what to turn the camera to; None: it stays, unless another thing is shown


class ViewerJoint(Shape):
    """One joint of the scene the 3D view shows."""

    name: str
    lower: float
    upper: float
    value: float


class ViewerShown(Shape):
    """What the 3D view shows now."""

    mode: str
    text: str
    reduced: bool = False  # fewer points or faces than there are; `full` shows all
    joints: list[ViewerJoint]


class JointValues(Shape):
    """Joint positions; they are clamped to the limits."""

    values: dict[Word, FiniteFloat] = Field(max_length=1000)
