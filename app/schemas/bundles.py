"""Finished bundles and the proof in them."""

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
    """How a gripper or an arm did at one joint or thing."""

    kind: str
    name: str
    method: str | None
    passed: bool
    grip_n: float | None
    opened: float | None  # 0..1 of the travel
    why: str
    picture: str | None  # address of a sheet of moments


class StandingPlace(Shape):
    """Where an arm stands, and for which joints."""

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


class SimulatorLines(Shape):
    """How a bundle is taken into one simulator."""

    simulator: str
    install: str
    language: str
    code: str
    note: str
    loader: str | None  # of the certificate: it loads the same file


class BundleInside(Shape):
    """A bundle's content for robots."""

    version: int
    assets: list[ObjectAsset]
    robots: list[RobotTrial]
    simulators: list[SimulatorLines]


class BundleChange(Shape):
    """One difference between two bundles; an empty object is the whole."""

    object: str
    text: str


class BundleCheck(Shape):
    """A bundle looked at again, now."""

    version: int
    intact: bool  # its bytes are those that were certified
    findings: list["Finding"]


class Finding(Shape):
    """One thing the linter or the simulation has to say."""

    rule: str
    severity: str
    where: str
    message: str


class LoaderVerdict(Shape):
    """One loader's verdict; one that is not installed is `not tried`."""

    loader: str
    state: str
    detail: str
    steps_per_s: list[list[float]] = Field(default_factory=list)  # pairs: worlds at once, and steps of all in a second


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
    cavity_open: float | None = None  # share of the space it opens that is free
    blocked_by: tuple[BlockerVerdict, ...] = ()


class ThingVerdict(Shape):
    """One free-standing thing, left alone."""

    name: str
    drift_m: float | None
    opening_free: float | None = None  # share of its hollow that no collider fills


class Doubt(Shape):
    """An object that may not be what was filmed, and why."""

    object: str
    why: str

    @model_validator(mode="before")
    @classmethod
    def from_pair(cls, stored: Any) -> Any:
        """Rows of November 2026 hold a pair."""
        return dict(zip(("object", "why"), stored, strict=True)) if isinstance(stored, list) else stored


class Likeness(Shape):
    """Whether the scene can be what was filmed: passed, doubtful or failed."""

    state: str
    doubts: list[Doubt]


class Certificate(Shape):
    """The proof in the newest bundle."""

    version: int
    current: bool  # nothing was changed since
    passed: bool
    likeness: Likeness | None = None  # of a bundle made before it was judged: null
    findings: list[Finding]
    loaders: list[LoaderVerdict]
    joints: list[JointVerdict]
    rest_penetration_m: float
    drift_m: float
    realtime_factor: float
    things: tuple[ThingVerdict, ...] = ()
    together_penetration_m: float | None = None  # deepest overlap when all joints open at once
