"""Overlays of the mesh on photos, for review."""

from typing import Literal

from app.schemas.base import Shape
from app.schemas.captures import Pinhole
from app.schemas.masks import Opening

OverlayOf = Literal["placed", "primitive", "fitted"]
OverlayLook = Literal["ghost", "outline", "residual"]


class Leaf(Shape):
    """The part moved by a joint of the object: its front as a box, closed, and the joint axis."""

    joint: str
    part: str  # its name in the object, the key of marks
    type: Literal["revolute", "prismatic"]
    most: float  # maximum opening, rad or m
    pose: list[list[float]]  # world_from_leaf, 4x4
    size_m: list[float]
    axis: list[float]  # world; opening rotates about it by the right-hand rule, or moves along it
    pivot: list[float]
    opening: Opening | None  # filmed and marked motion


class PhotoState(Shape):
    """Filmed joint position in a photo: rad or m; null if unknown."""

    joint: str
    type: Literal["revolute", "prismatic"]
    value: float | None
    sigma: float | None  # null where marked by a user


class Photo(Pinhole):
    """A frame that shows the object well, with its camera."""

    frame: int
    camera_from_world: list[list[float]]
    confidence: float
    box: list[float]  # left, top, right, bottom of its mask, as fractions of the image
    whole: bool  # whether the object is entirely within the image
    states: list[PhotoState]


class ObjectPhotos(Shape):
    """Photos for checking an object, entire views first, then the most confident; its box in the finished scene, if any.

    Overlays: /media/{project}/overlay/{object}/{frame}.png?of=fitted&look=ghost&v={version}.
    """

    photos: list[Photo]
    version: str
    of: list[OverlayOf]  # available overlays
    world_from_object: list[list[float]] | None
    dimensions_m: list[float] | None
    leaves: list[Leaf]  # of the finished scene
