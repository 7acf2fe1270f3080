"""What was checked, and what was measured."""

from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True, kw_only=True)
class JointResult:
    """One joint's sweep and drive test."""

    joint: str
    deepest_penetration_m: float  # over the kinematic sweep, 21 positions
    travel_reached: float  # 0..1 of the range under the stated force
    cavity_open: float | None = None  # 0..1 of the space it opens that no collider fills; None: no such space


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """The proof that goes into every bundle."""

    passed: bool
    findings: tuple[Finding, ...]
    loaders: tuple[LoaderResult, ...]
    joints: tuple[JointResult, ...]
    rest_penetration_m: float
    drift_m: float
    realtime_factor: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """One number of the metric set."""

    name: str
    value: float | None  # None: not applicable, with the reason in `note`
    unit: str
    better: Literal["lower", "higher"]
    tolerance: float  # how much worse than the baseline a gate allows, in the unit
    note: str = ""
