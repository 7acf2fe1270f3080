"""User inputs: prompts and overrides. A re-run only reads them and never writes back."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

from r2c2r_core.arrays import Matrix4, Vector3
from r2c2r_core.geometry.masks import PackedMask

HingeSide = Literal["left", "right", "top", "bottom"]  # as seen by a person facing the front


@dataclass(frozen=True, slots=True, kw_only=True)
class PromptPoint:
    """One click, in pixels of the stored RGB frame (continuous: pixel centres at i + 0.5)."""

    frame: int
    x: float
    y: float
    label: Literal[0, 1]  # 1 on the object, 0 off it


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnHandle:
    """A handle drawn by a person: x to the right and z up from the front's centre, metres."""

    left_m: float
    bottom_m: float
    right_m: float
    top_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnFront:
    """A front's rectangle drawn by a person in the elevation of its run."""

    # metres, capture frame: top left, top right, bottom right, bottom left, as a person facing the front sees them
    corners_capture: tuple[tuple[float, float, float], ...]
    handle: DrawnHandle | Literal["none"] | None = None  # None: detected in the image
    hinge: HingeSide | None = None  # None: inferred


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameSaid:
    """A person's statement on an object in one frame: its mask there, painted or confirmed, or that it is not visible."""

    frame: int
    mask: PackedMask | None  # at the frame's proportions, at any size; None: not visible


@dataclass(frozen=True, slots=True, kw_only=True)
class CropBox:
    """A box drawn by a person around an object: points outside do not belong to it."""

    corner_capture: tuple[float, float, float]  # metres, capture frame
    edges_capture: tuple[tuple[float, float, float], ...]  # three from that corner, at right angles to each other, metres


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectPrompt:
    """One object named by a person, and clicked or drawn."""

    name: str  # unique, [A-Za-z0-9_]+ (scene_synthesizer and simulators accept no more)
    category: str
    points: tuple[PromptPoint, ...]
    front: DrawnFront | None = None  # drawn: used unchanged, regardless of clicks
    frames: tuple[FrameSaid, ...] = ()  # at most one per frame; they override the segmentation
    crop: CropBox | None = None  # of a free object
    others: tuple[PromptPoint, ...] = ()  # clicks on other objects that lie on it: never in a file, set by segment


@dataclass(frozen=True, slots=True, kw_only=True)
class Prompts:
    """prompts.json."""

    objects: tuple[ObjectPrompt, ...]


class JointLimits(NamedTuple):
    """A person's limits of one joint, in rad or m; None is computed."""

    lower: float | None
    upper: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectOverride:
    """A person's corrections of one object; None is computed."""

    candidate: str | None = None  # a candidate id, or a mesh file
    hinge: HingeSide | None = None
    dimensions_m: Vector3 | None = None  # width, depth, height
    pose: Matrix4 | None = None  # world_from_object
    joint_lower: float | None = None  # of its only joint; rad or m
    joint_upper: float | None = None
    joints: Mapping[str, JointLimits] = field(default_factory=dict)  # by the joint's name or its part's
    states: Mapping[str, Mapping[int, float]] = field(default_factory=dict)  # by joint as above, by frame: rad or m
    rejected: tuple[str, ...] = ()  # candidate ids a reviewer rejected
    regenerate: int = 0  # number of further batches that a reviewer requested
    built_as: str | None = None  # the category whose body and joints it gets, regardless of its label
    left_out: bool = False  # removes an object that was added from the scan without a click
    colour: tuple[float, float, float] | None = None  # RGB 0..1, for objects without a mesh


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Overrides:
    """overrides.json."""

    objects: dict[str, ObjectOverride]
    up_capture: Vector3 | None = None  # in the capture frame
    floor_m: float | None = None  # height of the floor along up_capture, in the capture frame
    manhattan_yaw_rad: float | None = None
    walls: tuple[Vector3, ...] | None = None  # each (x, y, offset): normal in plan, into the room; world frame

    @property
    def room(self) -> "Overrides":
        """Only the corrections of the room."""
        return replace(self, objects={})

    def of(self, name: str) -> ObjectOverride:
        """The object's corrections; empty without any."""
        return self.objects.get(name, ObjectOverride())
