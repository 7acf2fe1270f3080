"""The finished scene."""

from typing import Literal

from app.schemas.base import Shape


class SceneJoint(Shape):
    """One joint; 0 is closed, positive opens. Angles in radians, lengths in metres."""

    name: str
    type: Literal["revolute", "prismatic"]
    axis: list[float]  # object frame
    origin: list[float]
    lower: float
    upper: float
    sources: dict[str, str]


class SceneItem(Shape):
    """One object of the finished scene."""

    object: int | None
    name: str
    category: str
    fixture: str
    dimensions_m: list[float]
    dimension_sources: list[str]
    joints: list[SceneJoint]
    movable: bool
    mask_frames: int
    placement_rms_m: float | None
    warp_residual_m: float | None
    warnings: list[str]


class StageInfo(Shape):
    """How one stage was run."""

    name: str
    backend: str
    seconds: float | None  # that its results took; None: not known


class SceneSummary(Shape):
    """The finished scene as a table."""

    items: list[SceneItem]
    failures: dict[str, str]  # object name -> why it is missing
    warnings: list[str]
    stages: list[StageInfo]
    glb: str | None
    preview: str | None
