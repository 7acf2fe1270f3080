"""Certificate and metrics: results of checks and measurements."""

from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One finding of the linter or the simulation."""

    rule: str
    severity: Literal["error", "warning"]
    where: str
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LoaderResult:
    """One loader's result; a loader that is not installed is `not tried`, never passed."""

    loader: str
    state: Literal["passed", "failed", "not tried"]
    detail: str
    steps_per_s: tuple[
        tuple[int, float], ...
    ] = ()  # number of parallel worlds, and their total steps per second on this machine


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocker:
    """Obstacle that keeps a joint from opening fully: a free object, or a part moved by another joint when that is open too."""

    name: str  # of the free object, or of the other joint
    kind: Literal["thing", "joint"]
    position: float  # of the blocked joint, rad or m: the first position of the sweep at which they overlap


@dataclass(frozen=True, slots=True, kw_only=True)
class JointResult:
    """One joint's sweep and drive test."""

    joint: str
    deepest_penetration_m: float  # over the kinematic sweep, 21 positions
    travel_reached: float  # fraction 0..1 of the range under the stated force
    cavity_open: float | None = None  # fraction 0..1 of the space it opens that no collider fills; None: no such space
    blocked_by: tuple[Blocker, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ThingResult:
    """Test of a free-standing object: whether it stays in place, and whether its opening is free of colliders."""

    name: str
    drift_m: float
    opening_free: float | None = None  # fraction 0..1 of its mesh's cavity that no collider fills; None: it has no cavity


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Distances from points of one surface to another."""

    median_m: float
    p95_m: float  # 95 % of the points lie nearer
    most_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ColliderFit:
    """Distances between a link's colliders and its visual."""

    link: str
    drawn_to_collider: Gap
    collider_to_drawn: Gap


@dataclass(frozen=True, slots=True, kw_only=True)
class Likeness:
    """Plausibility verdict of a certificate, beside that of physics: whether the scene can be the filmed one."""

    state: Literal["passed", "doubtful", "failed"]
    doubts: tuple[tuple[str, str], ...]  # objects to check, with reasons: contradictions first


ALIKE = Likeness(state="passed", doubts=())


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """Certificate included in every bundle."""

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
