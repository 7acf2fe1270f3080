"""Finished bundles and their certificates."""

from typing import Any

from pydantic import Field, model_validator

from app.schemas.base import Shape


class Bundle(Shape):
    """One finished bundle."""

    version: int
    url: str
    file_name: str
    sha256: str
    size: int
    created: float
    passed: bool | None
    current: bool  # nothing was changed since


class ObjectAsset(Shape):
    """One object of a bundle, to be downloaded by itself."""

    name: str
    category: str
    formats: list[str]  # suffixes of its files
    url: str


class RobotGrip(Shape):
    """Result of a gripper or an arm at one joint or free-standing object."""

    kind: str
    name: str
    method: str | None
    passed: bool
    grip_n: float | None
    opened: float | None  # 0..1 of the travel
    why: str
    picture: str | None  # address of a sheet of snapshots


class StandingPlace(Shape):
    """Base position of an arm, and the joints that it operates from there."""

    x_m: float
    y_m: float
    lift_m: float
    joints: list[str]


class RobotTrial(Shape):
    """One robot's trial in a bundle."""

    name: str
    joints: int
    joints_opened: int
    grips: list[RobotGrip]
    places: list[StandingPlace] = Field(default_factory=list)
    map: str | None = None  # address of the floor plan with its places
    why: str | None = None  # reason why it tried nothing


class SimulatorLines(Shape):
    """Loading code of a bundle for one simulator."""

    simulator: str
    install: str
    language: str
    code: str
    note: str
    loader: str | None  # of the certificate, which loads the same file


class BundleInside(Shape):
    """A bundle's content for robots."""

    version: int
    assets: list[ObjectAsset]
    robots: list[RobotTrial]
    simulators: list[SimulatorLines]


class BundleChange(Shape):
    """One difference between two bundles; an empty `object` refers to the whole bundle."""

    object: str
    text: str


class BundleCheck(Shape):
    """Result of a new check of a stored bundle."""

    version: int
    intact: bool  # its bytes are unchanged since it was certified
    findings: list["Finding"]


class Finding(Shape):
    """One finding of the linter or the simulation."""

    rule: str
    severity: str
    where: str
    message: str


class LoaderVerdict(Shape):
    """One loader's verdict; one that is not installed is `not tried`."""

    loader: str
    state: str
    detail: str
    steps_per_s: list[list[float]] = Field(default_factory=list)  # pairs: number of parallel worlds, total steps per second


class BlockerVerdict(Shape):
    """An obstacle that keeps a joint from opening completely: a free object, or the part of another open joint."""

    name: str
    kind: str
    position: float | None  # of the blocked joint


class JointVerdict(Shape):
    """One joint's sweep and drive test."""

    joint: str
    deepest_penetration_m: float
    travel_reached: float
    cavity_open: float | None = None  # fraction of the space it opens that no collider fills
    blocked_by: tuple[BlockerVerdict, ...] = ()


class ThingVerdict(Shape):
    """Rest test of one free-standing object."""

    name: str
    drift_m: float | None
    opening_free: float | None = None  # fraction of its cavity that no collider fills


class Doubt(Shape):
    """An object that may differ from the filmed one, and the reason."""

    object: str
    why: str

    @model_validator(mode="before")
    @classmethod
    def from_pair(cls, stored: Any) -> Any:
        """Convert the pairs stored in rows of November 2026."""
        return dict(zip(("object", "why"), stored, strict=True)) if isinstance(stored, list) else stored


class Likeness(Shape):
    """Plausibility of the scene as a model of the filmed one: passed, doubtful or failed."""

    state: str
    doubts: list[Doubt]


class Certificate(Shape):
    """The certificate in the newest bundle."""

    version: int
    current: bool  # nothing was changed since
    passed: bool
    likeness: Likeness | None = None  # null in bundles older than this check
    findings: list[Finding]
    loaders: list[LoaderVerdict]
    joints: list[JointVerdict]
    rest_penetration_m: float
    drift_m: float
    realtime_factor: float
    things: tuple[ThingVerdict, ...] = ()
    together_penetration_m: float | None = None  # deepest overlap when all joints open at once
