"""Finished bundles and the proof in them."""

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


class JointVerdict(Shape):
    """One joint's sweep and drive test."""

    joint: str
    deepest_penetration_m: float
    travel_reached: float
    cavity_open: float | None = None  # share of the space it opens that is free


class Certificate(Shape):
    """The proof in the newest bundle."""

    version: int
    passed: bool
    findings: list[Finding]
    loaders: list[LoaderVerdict]
    joints: list[JointVerdict]
    rest_penetration_m: float
    drift_m: float
    realtime_factor: float
