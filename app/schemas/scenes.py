"""The finished scene."""

from typing import Literal

from app.schemas.base import Shape
from app.schemas.reviews import OverrideData


class SceneJoint(Shape):
    """One joint; 0 is closed, positive opens. Angles in radians, lengths in metres."""

    name: str
    type: Literal["revolute", "prismatic"]
    axis: list[float]  # object frame
    origin: list[float]
    lower: float
    upper: float
    sources: dict[str, str]
    handle: list[float] | None  # centre, in the object frame, of the handle that was seen on it; None without one


class SceneItem(Shape):
    """One object of the finished scene."""

    object: int | None  # None: made from the scan without a click
    name: str
    run_name: str  # its name in the last run, in its joints and in the certificate
    category: str
    fixture: str
    dimensions_m: list[float]
    dimension_sources: list[str]
    joints: list[SceneJoint]
    movable: bool
    carried_by: str | None  # link of the drawer that it lies in
    mask_frames: int
    placement_rms_m: float | None
    warp_residual_m: float | None
    warnings: list[str]
    colour: list[float]  # RGB 0..1, of parts without a mesh
    override: OverrideData  # current corrections, including those since the last run
    changed: bool  # since the last run: all but `override` is older


class LeftOut(Shape):
    """An object made from the scan that the user does not want, or that the last run did not make."""

    object: int
    name: str


class StageInfo(Shape):
    """Backend and duration of one stage."""

    name: str
    backend: str
    seconds: float | None  # computation time of its results; None: unknown


class SceneSummary(Shape):
    """The finished scene as a table."""

    items: list[SceneItem]
    left_out: list[LeftOut]
    unused: list[LeftOut]  # corrected, without clicks, and not in the scene
    failures: dict[str, str]  # object name -> reason why it is missing
    warnings: list[str]
    stages: list[StageInfo]
    glb: str | None
    preview: str | None
