"""Overlays of the mesh on photos, for review."""

from typing import Literal

from app.schemas.base import Shape
from app.schemas.captures import Pinhole
from app.schemas.masks import Opening

OverlayOf = Literal["placed", "primitive", "fitted"]
OverlayLook = Literal["ghost", "outline", "residual"]


class Leaf(Shape):
    """The part moved by a joint of the object: its front as a box, closed, and the line it turns about or goes along."""

    joint: str
    part: str  # which of the object's it is: marks are by this
    type: Literal["revolute", "prismatic"]
    most: float  # how far it can open at all, rad or m
    pose: list[list[float]]  # world_from_leaf, 4x4
    size_m: list[float]
    axis: list[float]  # world; opening turns about it by the right-hand rule, or goes along it
    pivot: list[float]
    opening: Opening | None  # as it was filmed and marked


class PhotoState(Shape):
    """Where a joint stood in a photo, as it was filmed: rad or m; null where that is not known."""

    joint: str
    type: Literal["revolute", "prismatic"]
    value: float | None
    sigma: float | None  # null where a person said so


class Photo(Pinhole):
    """A frame that shows the object well, with its camera."""

    frame: int
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
    leaves: list[Leaf]  # of the finished scene
