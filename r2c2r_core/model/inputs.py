"""What people give: prompts and overrides. They are inputs, so a re-run flows forward and never back."""

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
    """A handle as a person drew it: x to the right and z up from the front's centre, metres."""

    left_m: float
    bottom_m: float
    right_m: float
    top_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnFront:
    """A front's rectangle as a person drew it in the elevation of its run."""

    # metres, capture frame: top left, top right, bottom right, bottom left, as a person facing the front sees them
    corners_capture: tuple[tuple[float, float, float], ...]
    handle: DrawnHandle | Literal["none"] | None = None  # None: looked for in the picture
    hinge: HingeSide | None = None  # None: inferred


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameSaid:
    """What a person said of an object in one frame: its mask there, painted or kept, or that it is not visible."""

    frame: int
    mask: PackedMask | None  # at the frame's proportions, at any size; None: not visible


@dataclass(frozen=True, slots=True, kw_only=True)
class CropBox:
    """A box that a person drew around a thing: what is found outside is none of it."""

    corner_capture: tuple[float, float, float]  # metres, capture frame
    edges_capture: tuple[tuple[float, float, float], ...]  # three from that corner, at right angles to each other, metres


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectPrompt:
    """One object a person named, and clicked or drew."""

    name: str  # unique, [A-Za-z0-9_]+ (scene_synthesizer and simulators accept no more)
    category: str
    points: tuple[PromptPoint, ...]
    front: DrawnFront | None = None  # drawn: used as it is, whatever is clicked
    frames: tuple[FrameSaid, ...] = ()  # at most one a frame; they stand, whatever is found there
    crop: CropBox | None = None  # of a thing
    others: tuple[PromptPoint, ...] = ()  # clicks on other objects that fall on it: never in a file, found by segment


@dataclass(frozen=True, slots=True, kw_only=True)
class Prompts:
    """prompts.json."""

    objects: tuple[ObjectPrompt, ...]


class JointLimits(NamedTuple):
    """What a person said about one joint, in rad or m; None is computed."""

    lower: float | None
    upper: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectOverride:
    """What a person corrected about one object; None is computed."""

    candidate: str | None = None  # a candidate id, or a mesh file
    hinge: HingeSide | None = None
    dimensions_m: Vector3 | None = None  # width, depth, height
    pose: Matrix4 | None = None  # world_from_object
    joint_lower: float | None = None  # of its only joint; rad or m
    joint_upper: float | None = None
    joints: Mapping[str, JointLimits] = field(default_factory=dict)  # by the joint's name or its part's
    states: Mapping[str, Mapping[int, float]] = field(default_factory=dict)  # by joint as above, by frame: rad or m
    rejected: tuple[str, ...] = ()  # candidate ids a reviewer rejected
    regenerate: int = 0  # times a reviewer asked for further candidates
    built_as: str | None = None  # the category whose body and joints it takes, whatever it is called
    left_out: bool = False  # of what is made from the scan unclicked: it is none of the scene
    colour: tuple[float, float, float] | None = None  # RGB 0..1, of what no mesh dresses


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
        """Only what was said of the room."""
        return replace(self, objects={})

    def of(self, name: str) -> ObjectOverride:
        """The object's corrections; empty when there are none."""
        return self.objects.get(name, ObjectOverride())
