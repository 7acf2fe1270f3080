"""API schemas of the 3D view."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from app.schemas.base import Shape
from app.schemas.text import Word


class ViewerSession(Shape):
    """Address of a project's 3D view; the fallbacks when it is down."""

    state: Literal["ready", "down"]
    url: str | None  # for the iframe, ends in a slash
    message: str
    fallback_page: str | None  # the bundle's own 3D page
    fallback_image: str | None


Row = Annotated[list[Annotated[float, Field(ge=-1e4, le=1e4)]], Field(min_length=4, max_length=4)]
Pose = Annotated[list[Row], Field(min_length=4, max_length=4)]
Side = Annotated[float, Field(gt=0, le=100)]


class ViewerBox(Shape):
    """The box of an object to be moved by hand."""

    pose: Pose  # world_from_object
    size: tuple[Side, Side, Side]  # width, depth, height in metres


class ViewerPlace(Shape):
    """New pose of the object being moved by hand, world_from_object; null leaves it unchanged."""

    pose: Pose | None


class ViewerPlaced(Shape):
    """Pose of the object being moved by hand, world_from_object; null without one."""

    pose: list[list[float]] | None


Coordinates = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class ViewerCamera(Shape):
    """Position and target of a camera of the 3D view, in the world."""

    position: Coordinates
    target: Coordinates


class ViewerClip(Shape):
    """A clip box, as fractions of the scene's width, depth (from its fronts) and height."""

    low: tuple[Share, Share, Share]
    high: tuple[Share, Share, Share]


class ViewerLook(Shape):
    """Display settings and camera of the 3D view, as stored with a comment."""

    mode: Literal["cloud", "candidate", "aligned", "scene"]
    draw: Literal["meshes", "wireframe", "colliders", "both", "distance", "unobserved"] = "meshes"  # of the scene
    cloud: bool = True  # the scan behind it
    opacity: float = Field(default=1.0, ge=0.0, le=1.0)
    hidden: list[Word] = Field(default_factory=list, max_length=1000)  # names of objects of the scene, as in its table
    parallel: bool = False  # nearly orthographic
    clip: ViewerClip | None = None  # of the scene and the scan
    camera: ViewerCamera | None = None  # None: unchanged, unless other content is shown


class ViewerShow(ViewerLook):
    """The requested content of the 3D view."""

    object: int | None = Field(default=None, ge=0, lt=2**63)
    made: Word | None = None  # name of an object made from the scan, if no object is chosen
    candidate: Word | None = None
    tape: list[Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]] = Field(
        default_factory=list, max_length=2
    )  # between two points of the world, metres
    box: ViewerBox | None = None  # with handles to move it by (aligned only, with an object)
    full: bool = False  # all points and faces, at any cost
    # camera target, or side to look from; None: unchanged, unless other content is shown
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
    reduced: bool = False  # fewer points or faces than exist; `full` shows all
    joints: list[ViewerJoint]
    preview: list[str] = Field(default_factory=list)  # names of objects shown as corrected since the last run
    span_m: Coordinates | None = None  # width, depth and height of the clip box's span
    part: ViewerClip | None = None  # bounds of the chosen object in it


class ViewerPicked(Shape):
    """The object or point of the last click in the 3D view."""

    number: int  # of the click
    name: str  # of the object, as in the scene's table; empty without one
    object: int | None
    point: list[float] | None  # in the world, metres


class JointValues(Shape):
    """Joint positions; they are clamped to the limits."""

    values: dict[Word, FiniteFloat] = Field(max_length=1000)
