"""The mesh over the photos: what a reviewer trusts."""

from typing import Literal

from app.schemas.base import Shape

OverlayOf = Literal["placed", "primitive", "fitted"]
OverlayLook = Literal["ghost", "outline", "residual"]


class PhotoState(Shape):
    """Where a joint stood in a photo, as it was filmed: rad or m; null where that is not known."""

    joint: str
    type: Literal["revolute", "prismatic"]
    value: float | None
    sigma: float | None


class Photo(Shape):
    """A frame that shows the object well, with its pinhole camera (pixels of the stored frame, OpenCV axes)."""

    frame: int
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    camera_from_world: list[list[float]]
    confidence: float
    box: list[float]  # left, top, right, bottom of its mask, as shares of the image
    whole: bool  # whether it ends before the image does
    states: list[PhotoState]


class ObjectPhotos(Shape):
    """The photos to check an object on, whole ones first, then the surest; its box in the finished scene, where there is one.

    Overlays: /media/{project}/overlay/{object}/{frame}.png?of=fitted&look=ghost&v={version}.
    """

    photos: list[Photo]
    version: str
    of: list[OverlayOf]  # what there is to lay over them
    world_from_object: list[list[float]] | None
    dimensions_m: list[float] | None
