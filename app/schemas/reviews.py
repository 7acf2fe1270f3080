"""Candidates, verdicts and corrections."""

from typing import Literal

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.jobs import Job
from app.schemas.text import Reference, Remark, Word
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.schema.overrides import (
    BATCHES_SAID,
    BUILT_AS_SAID,
    COLOUR_SAID,
    HINGE_SAID,
    JOINTS_SAID,
    LEFT_OUT_SAID,
    MOST_BATCHES,
    MOST_JOINTS,
    POSE_SAID,
    SIZE_SAID,
    STATES_SAID,
    CategoryName,
    Colour,
    Dimensions,
    Limits,
    MarkedState,
    Marks,
    Opening,
    Pose,
)


class Candidate(Shape):
    """One candidate mesh with its evidence."""

    id: str
    generator: str
    seed: int
    assumes: str  # its hypothesis about unseen parts; empty: a generator's own sample
    watertight: bool
    faces: int
    frames: list[int]
    metrics: dict[str, float]
    parameters: dict[str, float]
    warnings: list[str]
    verdict: Literal["accepted", "rejected"] | None
    verdict_reason: str
    verdict_by: str
    glb: str
    thumbnail: str


class Difference(Shape):
    """Surface difference of a candidate from another one, aligned by the filmed side."""

    candidate: str
    share: float  # fraction of its surface that differs
    most: float  # maximum distance, as a fraction of the other's longest side


class MeshLook(Shape):
    """Preview of an uploaded mesh as a candidate: repaired, but neither placed nor scaled."""

    name: str
    size: list[float]  # of its box along the file's axes, longest first, in the file's unit
    object_size_m: list[float] | None  # of the part in the masks, along the world axes, longest first; None without masks
    triangles: int
    notes: list[str]  # repaired, dropped, merged and missing parts; empty: it is used unchanged
    picture: str  # base64 of a PNG


class Crop(Shape):
    """A frame from which candidates were made, and the object's position in it."""

    frame: int
    width: int
    height: int
    box: list[float]  # left, top, right, bottom of its mask, as fractions of the image


class Differences(Shape):
    """Differences between candidates.

    Turntables: /media/{project}/candidates/{object}/{candidate}/turns.png?against={candidate}, 24 pictures from left to right.
    """

    against: str
    tolerance: float  # distance, as a fraction of the longest side, above which surfaces differ
    longest_m: float | None  # None before placement
    candidates: list[Difference]
    crops: list[Crop]


class PoseSpread(Shape):
    """Uncertainty of a pose: standard deviations, each in the least constrained direction."""

    turn_deg: float
    shift_m: float
    scale: float


class Placement(Shape):
    """Placement of the chosen candidate, with its evidence."""

    candidate: str
    scale: float
    translation_m: list[float]
    matches: int
    inliers: int
    rms_m: float | None  # None: no depth in its masks
    mask_iou: float
    condition: float
    unsure: bool
    runner_up: float | None
    runner_up_turn_deg: float | None
    spread: PoseSpread | None
    method: str
    votes: dict[int, int]
    warnings: list[str]


class CandidateGroup(Shape):
    """All candidates of one object, the automatic choice and its reason, and the users' verdicts and corrections."""

    object: int
    name: str
    run_name: str  # its name in the last run, in the scene's joints and in the certificate
    category: str
    assignee: str | None  # current assignee
    chosen: str
    chosen_by: str
    reason: str
    ranking: list[str]
    accepted: str | None
    candidates: list[Candidate]
    placement: Placement | None
    override: "OverrideData"
    changed: bool  # since the last run: placement and scene are older
    version: int  # increased by every verdict, correction and undo of them
    can_undo: bool
    can_redo: bool
    can_regenerate: bool  # whether further candidates may be requested


class VerdictIn(Shape):
    """A reviewer's verdict. Rejecting the last one makes new candidates; accepting another one aligns it again."""

    candidate: Word
    verdict: Literal["accepted", "rejected", "cleared"]
    reason: Remark = ""
    rerun: bool = True
    version: int | None = Field(default=None, ge=0)  # as last seen: 409 if it was reviewed since


class OverrideData(Shape):
    """Manual corrections of one object; None: computed value."""

    candidate: str | None = None
    hinge: HingeSide | None = None
    dimensions_m: tuple[float, float, float] | None = None
    pose: list[list[float]] | None = None  # world_from_object, 4x4
    joint_lower: float | None = None
    joint_upper: float | None = None
    joints: dict[str, tuple[float | None, float | None]] = Field(default_factory=dict)  # [lower, upper] by name
    states: dict[str, list[MarkedState]] = Field(default_factory=dict)  # by joint as above
    rejected: list[str] = Field(default_factory=list)
    regenerate: int = 0
    built_as: str | None = None  # the category whose body and joints are used
    left_out: bool = False
    colour: tuple[float, float, float] | None = None  # RGB 0..1


class OverridePatch(Shape):
    """The fields that are present are set; null clears."""

    candidate: Reference | None = None
    hinge: HingeSide | None = Field(default=None, description=HINGE_SAID)
    dimensions_m: Dimensions | None = Field(default=None, description=SIZE_SAID)
    pose: Pose | None = Field(default=None, description=POSE_SAID)
    joint_lower: Opening | None = None
    joint_upper: Opening | None = None
    joints: dict[Reference, Limits] | None = Field(default=None, max_length=MOST_JOINTS, description=JOINTS_SAID)
    states: dict[Reference, Marks] | None = Field(default=None, max_length=MOST_JOINTS, description=STATES_SAID)
    regenerate: int | None = Field(default=None, ge=0, le=MOST_BATCHES, description=BATCHES_SAID)
    built_as: CategoryName | None = Field(default=None, description=BUILT_AS_SAID)
    left_out: bool | None = Field(default=None, description=LEFT_OUT_SAID)
    colour: Colour | None = Field(default=None, description=COLOUR_SAID)
    rerun: bool = True
    version: int | None = Field(default=None, ge=0)  # as last seen: 409 if it was reviewed since


class Reviewed(Shape):
    """The object after a verdict or a correction, and the resulting job."""

    group: CandidateGroup | None
    job: Job | None
    text: str
