"""API schemas of the 3D view."""

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


Coordinates = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class ViewerCamera(Shape):
    """Where a camera of the 3D view stands in the world, and what it looks at."""

    position: Coordinates
    target: Coordinates


class ViewerClip(Shape):
    """A box outside which nothing is shown, as shares of the scene's width, depth (from its fronts) and height."""

    low: tuple[Share, Share, Share]
    high: tuple[Share, Share, Share]


class ViewerLook(Shape):
    """How the 3D view is looked at: what a comment keeps."""

    mode: Literal["cloud", "candidate", "aligned", "scene"]
    draw: Literal["meshes", "wireframe", "colliders", "both", "distance", "unobserved"] = "meshes"  # of the scene
    cloud: bool = True  # the scan behind it
    opacity: float = Field(default=1.0, ge=0.0, le=1.0)
    hidden: list[Word] = Field(default_factory=list, max_length=1000)  # names of objects of the scene, as its table has them
    parallel: bool = False  # seen from so far off that parallels stay parallel
    clip: ViewerClip | None = None  # of the scene and the scan
    camera: ViewerCamera | None = None  # None: it stays, unless another thing is shown


class ViewerShow(ViewerLook):
    """The requested content of the 3D view."""

    object: int | None = Field(default=None, ge=0, lt=2**63)
    made: Word | None = None  # what was made from the scan, by its name there, where no object is chosen
    candidate: Word | None = None
    tape: list[Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]] = Field(
        default_factory=list, max_length=2
    )  # between two points of the world, metres
    box: ViewerBox | None = None  # with handles to move it by (aligned only, with an object)
    full: bool = False  # every point and face, whatever it costs
    # what to turn the camera to, or the side to look from; None: it stays, unless another thing is shown
    look: Literal["object", "scene", "front", "back", "left", "right", "top", "bottom", "run", "photo"] | None = None
    frame: int | None = Field(default=None, ge=0, lt=2**31)  # of the photo to look from


class ViewerJoint(Shape):
    """One joint of the scene the 3D view shows."""

    name: str
    lower: float
    upper: float
    value: float


class ViewerShown(Shape):
    """The current content of the 3D view."""

    mode: str
    text: str
    reduced: bool = False  # fewer points or faces than there are; `full` shows all
    joints: list[ViewerJoint]
    preview: list[str] = Field(default_factory=list)  # names of objects shown as corrected since the last run
    span_m: Coordinates | None = None  # width, depth and height of what a clip box cuts
    part: ViewerClip | None = None  # what the chosen object reaches of that


class ViewerPicked(Shape):
    """The object or point of the last click in the 3D view."""

    number: int  # of the click
    name: str  # of the object, as the scene's table has it; empty where none is
    object: int | None
    point: list[float] | None  # in the world, metres


class JointValues(Shape):
    """Joint positions; they are clamped to the limits."""

    values: dict[Word, FiniteFloat] = Field(max_length=1000)
