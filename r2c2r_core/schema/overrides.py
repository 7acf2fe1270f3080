"""Model of overrides.json, the manual corrections. Bounds keep a typing error from exhausting memory."""

from typing import Annotated, Any, TypeAlias, cast

import numpy as np
from pydantic import AfterValidator, Field, Strict, model_validator

from r2c2r_core.arrays import Vector3
from r2c2r_core.model.inputs import HingeSide, JointLimits, ObjectOverride, Overrides
from r2c2r_core.schema.document import Document
from r2c2r_core.schema.prompts import MOST_FRAMES, MOST_OBJECTS, Version

MOST_BATCHES = 20  # of further candidates
LARGEST_M, SMALLEST_M = 10.0, 0.001  # of an object in a kitchen
FARTHEST_M = 1000.0  # from the recording's origin, the readers' own limit
FULL_TURN = 6.3  # rad, or m: no door turns further, no drawer slides as far
_MOST_REJECTED, _MOST_WALLS, MOST_JOINTS, MOST_MARKS = 1000, 100, 100, 1000
_RIGID = 0.03  # error of a rotation rounded to two decimals


def _is_direction(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if np.linalg.norm(value) < 1e-6:
        raise ValueError("a direction of no length")
    return value


def _is_wall(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if np.linalg.norm(value[:2]) < 1e-6:
        raise ValueError("a wall without a normal")
    return value


def _is_rigid(rows: list[list[float]]) -> list[list[float]]:
    pose = np.array(rows)
    rotation = pose[:3, :3]
    turns = np.allclose(rotation.T @ rotation, np.eye(3), atol=_RIGID) and np.linalg.det(rotation) > 0
    if not turns or not np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0)):
        raise ValueError("it moves nothing rigidly")
    return rows


def _opens_from_closed(limits: tuple[float | None, float | None]) -> tuple[float | None, float | None]:
    lower, upper = limits
    if lower or (upper is not None and upper <= 0):
        raise ValueError(f"[{lower}, {upper}] does not open from 0, the closed state, in the positive direction")
    return limits


Size: TypeAlias = Annotated[float, Field(ge=SMALLEST_M, le=LARGEST_M)]
Coordinate: TypeAlias = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
Opening: TypeAlias = Annotated[float, Field(ge=-FULL_TURN, le=FULL_TURN)]
_Row: TypeAlias = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
_Three: TypeAlias = Annotated[tuple[Coordinate, Coordinate, Coordinate], Strict(False)]
Dimensions: TypeAlias = Annotated[tuple[Size, Size, Size], Strict(False)]
Pose: TypeAlias = Annotated[list[_Row], Field(min_length=4, max_length=4), AfterValidator(_is_rigid)]
Direction: TypeAlias = Annotated[_Three, AfterValidator(_is_direction)]
Wall: TypeAlias = Annotated[_Three, AfterValidator(_is_wall)]
Limits: TypeAlias = Annotated[tuple[Opening | None, Opening | None], Strict(False), AfterValidator(_opens_from_closed)]
CategoryName: TypeAlias = Annotated[str, Field(min_length=1, max_length=200)]
_Share: TypeAlias = Annotated[float, Field(ge=0.0, le=1.0)]
Colour: TypeAlias = Annotated[tuple[_Share, _Share, _Share], Strict(False)]
CandidateId: TypeAlias = Annotated[str, Field(min_length=1, max_length=200)]
JointName: TypeAlias = Annotated[str, Field(min_length=1, max_length=200)]

SIZE_SAID = f"[width, depth, height]: three numbers of metres, positive, at most {LARGEST_M:g}"
POSE_SAID = f"a 4x4 world_from_object: a rotation, and a translation within {FARTHEST_M:g} m"
LIMITS_SAID = f"[0, upper]: closed, and rad or m above 0 up to {FULL_TURN:g}; null for what stays computed"
JOINTS_SAID = f"a table of joints, each by its name or its part's, with {LIMITS_SAID}"
STATES_SAID = "a table of joints as under joints, each with the frames in which a person marked how far it stands open"
HINGE_SAID = "left, right, top or bottom, as seen by a person facing the front; of a sliding door: where it slides to"
BUILT_AS_SAID = "a category of the table, whose body and joints it takes, whatever it is called"
LEFT_OUT_SAID = "true leaves out a worktop or plinth that was made from the scan without clicks"
COLOUR_SAID = "[red, green, blue] from 0 to 1, of a worktop or plinth that was made from the scan"
BATCHES_SAID = f"0 to {MOST_BATCHES}: how often further candidates were asked for"


class MarkedState(Document):
    """How far a joint stands open in one frame."""

    frame: int = Field(ge=0, lt=MOST_FRAMES, description="the frame's number")
    state: float = Field(ge=0, le=FULL_TURN, description=f"rad or m up to {FULL_TURN:g}; 0 is closed")


Marks: TypeAlias = Annotated[list[MarkedState], Field(max_length=MOST_MARKS)]


class ObjectCorrections(Document):
    """Manual corrections of one object; absent keys and null are computed."""

    candidate: str | None = Field(
        default=None, min_length=1, max_length=4000, description="a candidate's id, or a mesh file relative to this file"
    )
    hinge: HingeSide | None = Field(default=None, description=HINGE_SAID)
    dimensions_m: Dimensions | None = Field(default=None, description=SIZE_SAID)
    pose: Pose | None = Field(default=None, description=POSE_SAID)
    joint_limits: Limits | None = Field(default=None, description=f"{LIMITS_SAID}: of the object's only joint")
    joints: dict[JointName, Limits] | None = Field(
        default=None,
        max_length=MOST_JOINTS,
        description=JOINTS_SAID,
    )
    states: dict[JointName, Marks] | None = Field(default=None, max_length=MOST_JOINTS, description=STATES_SAID)
    rejected: list[CandidateId] = Field(
        default_factory=list, max_length=_MOST_REJECTED, description="a list of the ids of candidates that a reviewer rejected"
    )
    regenerate: int = Field(default=0, ge=0, le=MOST_BATCHES, description=BATCHES_SAID)
    built_as: CategoryName | None = Field(default=None, description=BUILT_AS_SAID)
    left_out: bool = Field(default=False, description=LEFT_OUT_SAID)
    colour: Colour | None = Field(default=None, description=COLOUR_SAID)

    def override(self, candidate: str | None) -> ObjectOverride:
        """The pipeline's ObjectOverride, with the candidate as resolved by the caller."""
        lower, upper = self.joint_limits or (None, None)
        return ObjectOverride(
            candidate=candidate,
            hinge=self.hinge,
            dimensions_m=_array(self.dimensions_m),
            pose=None if self.pose is None else np.array(self.pose, dtype=np.float64),
            joint_lower=lower,
            joint_upper=upper,
            joints={name: JointLimits(*limits) for name, limits in (self.joints or {}).items()},
            states={name: {mark.frame: mark.state for mark in marks} for name, marks in (self.states or {}).items()},
            rejected=tuple(self.rejected),
            regenerate=self.regenerate,
            built_as=self.built_as,
            left_out=self.left_out,
            colour=self.colour,
        )


class SceneCorrections(Document):
    """Manual corrections of the room; absent keys and null are computed."""

    up: Direction | None = Field(default=None, description="three numbers: the direction up, in the capture frame")
    floor: Coordinate | None = Field(
        default=None, description=f"a number: metres of the floor along up, within ±{FARTHEST_M:g}, in the capture frame"
    )
    manhattan_yaw: Opening | None = Field(
        default=None, description="a number of radians: how far the walls are turned about up, at most once round"
    )
    walls: list[Wall] | None = Field(
        default=None,
        max_length=_MOST_WALLS,
        description="a list of walls [x, y, offset]: three numbers, the normal in plan, into the room, and metres along it",
    )


class OverridesFile(Document):
    """overrides.json."""

    version: Version = Field(default=1, description="1, the current format")
    objects: dict[Annotated[str, Field(max_length=200)], ObjectCorrections] = Field(
        default_factory=dict, max_length=MOST_OBJECTS, description="a table of objects by name"
    )
    scene: SceneCorrections = Field(default_factory=SceneCorrections, description="what a person said about the room")

    @model_validator(mode="before")
    @classmethod
    def _by_name(cls, value: Any) -> Any:
        """Accept a list of objects, as in prompts.json."""
        listed = value.get("objects") if isinstance(value, dict) else None
        if not isinstance(listed, list):
            return value
        if not all(isinstance(entry, dict) and isinstance(entry.get("name"), str) for entry in listed):
            raise ValueError("an entry of objects has no name")
        named = {entry["name"]: {k: v for k, v in entry.items() if k != "name"} for entry in listed}
        if len(named) < len(listed):
            raise ValueError("two entries of objects have the same name")
        return {**value, "objects": named}

    def room(self, objects: dict[str, ObjectOverride]) -> Overrides:
        """The pipeline's Overrides, with its objects."""
        scene = self.scene
        return Overrides(
            objects=objects,
            up_capture=_array(scene.up),
            floor_m=scene.floor,
            manhattan_yaw_rad=scene.manhattan_yaw,
            walls=None if scene.walls is None else tuple(cast(Vector3, _array(wall)) for wall in scene.walls),
        )


def _array(values: tuple[float, ...] | None) -> np.ndarray | None:
    return None if values is None else np.array(values, dtype=np.float64)
