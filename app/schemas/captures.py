"""A recording: facts, quality and frames."""

from pydantic import Field

from app.schemas.base import Shape


class CaptureRemark(Shape):
    """One problem of a recording, its severity, and a remedy."""

    verdict: str  # good | usable with care | unusable
    cause: str
    text: str
    advice: str


class CaptureMoment(Shape):
    """Measures of one frame examined by the capture doctor."""

    frame_index: int
    sharpness: float  # relative to the median frame's
    depth_share: float
    brightness: float
    error_mm: float | None  # difference of its depth from a later frame's


class CaptureFigure(Shape):
    """One measured figure, formatted for display."""

    name: str
    value: str


class CaptureFacts(Shape):
    """Facts about the recording, shown before any work starts. Pictures: /media/{project}/scan/plan.png and view.png."""

    format: str = ""
    sha256: str = ""
    frame_count: int = 0
    width: int = 0
    height: int = 0
    depth_width: int = 0
    depth_height: int = 0
    duration_s: float | None = None
    path_length_m: float = 0.0
    up_source: str = ""
    floor_found: bool = False
    verdict: str = ""  # good | usable with care | unusable
    remarks: list[CaptureRemark] = Field(default_factory=list)  # worst first
    figures: list[CaptureFigure] = Field(default_factory=list)
    moments: list[CaptureMoment] = Field(default_factory=list)


class Pinhole(Shape):
    """A frame's size and pinhole camera, in pixels of the stored frame; its axes are OpenCV's."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


class FrameCamera(Pinhole):
    """The camera of a frame in the recording's own world."""

    camera_from_capture: list[list[float]]


class FrameInfo(Shape):
    """One frame; `index` is its number in the recording. Image: /media/{project}/frames/{index}.jpg?w=960&v={media_version}."""

    index: int
    timestamp_s: float | None
    width: int
    height: int
    sharpness: float
    camera: list[float]  # position in the world frame, metres
