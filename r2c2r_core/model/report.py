"""What was checked, and what was measured."""

from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing the linter or the simulation has to say."""

    rule: str
    severity: Literal["error", "warning"]
    where: str
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LoaderResult:
    """One loader's verdict; a loader that is not installed is `not tried`, never passed."""

    loader: str
    state: Literal["passed", "failed", "not tried"]
    detail: str
    steps_per_s: tuple[tuple[int, float], ...] = ()  # worlds at once, and steps of all of them in a second of this machine


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocker:
    """What keeps a joint from opening all the way: a loose thing, or what another joint moves when that is open too."""

    name: str  # of the thing's object, or of the other joint
    kind: Literal["thing", "joint"]
    position: float  # of the blocked joint, rad or m: the first of the sweep at which they overlap


@dataclass(frozen=True, slots=True, kw_only=True)
class JointResult:
    """One joint's sweep and drive test."""

    joint: str
    deepest_penetration_m: float  # over the kinematic sweep, 21 positions
    travel_reached: float  # 0..1 of the range under the stated force
    cavity_open: float | None = None  # 0..1 of the space it opens that no collider fills; None: no such space
    blocked_by: tuple[Blocker, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ThingResult:
    """A free-standing thing: whether it stays where it stands, and whether its opening is open to an engine."""

    name: str
    drift_m: float
    opening_free: float | None = None  # 0..1 of the hollow of its mesh that no collider fills; None: it has no hollow


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Distances from points of one surface to another."""

    median_m: float
    p95_m: float  # 95 % of the points lie nearer
    most_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ColliderFit:
    """How far what an engine touches of a link lies from what is drawn of it."""

    link: str
    drawn_to_collider: Gap
    collider_to_drawn: Gap


@dataclass(frozen=True, slots=True, kw_only=True)
class Likeness:
    """Whether the scene can be what was filmed: the second verdict of a certificate, beside that of physics."""

    state: Literal["passed", "doubtful", "failed"]
    doubts: tuple[tuple[str, str], ...]  # objects to look at, and why: contradictions first


ALIKE = Likeness(state="passed", doubts=())


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """The proof that goes into every bundle."""

    passed: bool
    likeness: Likeness
    findings: tuple[Finding, ...]
    loaders: tuple[LoaderResult, ...]
    joints: tuple[JointResult, ...]
    rest_penetration_m: float
    drift_m: float
    realtime_factor: float  # simulated seconds per second of one processor core
    things: tuple[ThingResult, ...] = ()
    together_penetration_m: float = float("nan")  # deepest overlap when all joints open at once
    colliders: tuple[ColliderFit, ...] = ()
    left_out: dict[str, str] = field(default_factory=dict)  # objects that could not be written, with one line each


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """One number of the metric set."""

    name: str
    value: float | None  # None: not applicable, with the reason in `note`
    unit: str
    better: Literal["lower", "higher"]
    tolerance: float  # how much worse than the baseline a gate allows, in the unit
    note: str = ""
