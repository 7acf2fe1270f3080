"""What the 3D view shows."""

from typing import Literal

from pydantic import Field

from app.schemas.base import Shape


class ViewerSession(Shape):
    """Where the 3D view of a project is; `fallback` when it is down."""

    state: Literal["ready", "down"]
    url: str | None  # for the iframe, ends in a slash
    message: str
    fallback_page: str | None  # the bundle's own 3D page
    fallback_image: str | None


class ViewerShow(Shape):
    """What the 3D view shows."""

    mode: Literal["cloud", "candidate", "aligned", "scene"]
    object: int | None = Field(default=None, ge=0, lt=2**63)
    candidate: str | None = Field(default=None, max_length=60)
    cloud: bool = True  # the scan behind it
    opacity: float = Field(default=1.0, ge=0.0, le=1.0)
    collision: bool = False  # colliders instead of what is seen (scene only)
    full: bool = False  # every point and face, whatever it costs


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
    joints: list[ViewerJoint]


class JointValues(Shape):
    """Joint positions; they are clamped to the limits."""

    values: dict[str, float]
