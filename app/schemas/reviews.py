"""Candidates, what people say about them, and what they correct."""

from typing import Literal

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.jobs import Job
from app.schemas.text import Reference, Remark, Word
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.schema.overrides import (
    BATCHES_SAID,
    HINGE_SAID,
    JOINTS_SAID,
    MOST_BATCHES,
    MOST_JOINTS,
    POSE_SAID,
    SIZE_SAID,
    Dimensions,
    Limits,
    Opening,
    Pose,
)


class Candidate(Shape):
    """One candidate mesh with its evidence."""

    id: str
    generator: str
    seed: int
    assumes: str  # what it takes for true of what nobody saw; empty: a sample of a generator's own
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


class PoseSpread(Shape):
    """By how much a pose may be off: standard deviations, each of the direction held least."""

    turn_deg: float
    shift_m: float
    scale: float


class Placement(Shape):
    """Where the chosen candidate stands, with the evidence for it."""

    candidate: str
    scale: float
    translation_m: list[float]
    matches: int
    inliers: int
    rms_m: float | None  # None: no depth inside its masks
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
    """All candidates of one object, the automatic choice and its reason, and what people said."""

    object: int
    name: str
    run_name: str  # what the last run called it, as do the scene's joints and the certificate
    category: str
    chosen: str
    chosen_by: str
    reason: str
    ranking: list[str]
    accepted: str | None
    candidates: list[Candidate]
    placement: Placement | None
    override: "OverrideData"
    version: int  # grows with every verdict, correction and undo of them
    can_undo: bool
    can_redo: bool
    can_regenerate: bool  # whether further candidates may be asked for


class VerdictIn(Shape):
    """What a reviewer says. Rejecting the last one makes new candidates; accepting another one aligns it anew."""

    candidate: Word
    verdict: Literal["accepted", "rejected", "cleared"]
    reason: Remark = ""
    rerun: bool = True
    version: int | None = Field(default=None, ge=0)  # as last seen: 409 when somebody said something since


class OverrideData(Shape):
    """What a person corrected about one object; None is computed."""

    candidate: str | None = None
    hinge: HingeSide | None = None
    dimensions_m: tuple[float, float, float] | None = None
    pose: list[list[float]] | None = None  # world_from_object, 4x4
    joint_lower: float | None = None
    joint_upper: float | None = None
    joints: dict[str, tuple[float | None, float | None]] = Field(default_factory=dict)  # [lower, upper] by name
    rejected: list[str] = Field(default_factory=list)
    regenerate: int = 0


class OverridePatch(Shape):
    """The fields that are present are set; null clears."""

    candidate: Reference | None = None
    hinge: HingeSide | None = Field(default=None, description=HINGE_SAID)
    dimensions_m: Dimensions | None = Field(default=None, description=SIZE_SAID)
    pose: Pose | None = Field(default=None, description=POSE_SAID)
    joint_lower: Opening | None = None
    joint_upper: Opening | None = None
    joints: dict[Reference, Limits] | None = Field(default=None, max_length=MOST_JOINTS, description=JOINTS_SAID)
    regenerate: int | None = Field(default=None, ge=0, le=MOST_BATCHES, description=BATCHES_SAID)
    rerun: bool = True
    version: int | None = Field(default=None, ge=0)  # as last seen: 409 when somebody said something since


class Reviewed(Shape):
    """The object after a verdict or a correction, and the job that follows from it."""

    group: CandidateGroup | None
    job: Job | None
    text: str
