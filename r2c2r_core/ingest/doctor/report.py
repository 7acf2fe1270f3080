"""The capture doctor's report on a recording."""

from dataclasses import asdict, dataclass, fields
from typing import Any, Literal

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.doctor.hypotheses import Finding
from r2c2r_core.ingest.doctor.registration import Registration

Verdict = Literal["good", "usable with care", "unusable"]
VERDICTS: tuple[Verdict, ...] = ("good", "usable with care", "unusable")
VERSION = 2  # of the document that `to_json` returns


@dataclass(frozen=True, slots=True, kw_only=True)
class Remark:
    """One finding about a recording, with its severity and advice."""

    verdict: Verdict
    cause: str  # a word for programs, such as "poses_inverted"
    text: str
    advice: str

    @property
    def line(self) -> str:
        """The finding and its advice as one line of text."""
        return f"{self.text}; {self.advice}"


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureFigures:
    """Quality measures of a recording."""

    frames: int
    first_frame: int
    last_frame: int
    missing_share: float  # of the frames between the first and the last, by number: neither images nor pose
    without_pose_share: float  # of the same: images, but no usable pose
    unreadable_share: float  # of the frames with a pose: damaged images
    longest_gap_s: float | None
    rgb_size: tuple[int, int]  # width, height
    depth_size: tuple[int, int]
    fps: float | None
    duration_s: float | None
    path_m: float
    turned_deg: float
    depth_coverage: float  # share of pixels with usable depth in the median frame
    recorded_depth_m: float | None  # median of the depth as recorded, before anything was rejected
    confidence_shares: tuple[float, float, float] | None  # low, medium, high; None: the format has no confidence
    median_depth_m: float
    blurred_share: float  # frames with less than a third of the median sharpness
    overexposed_share: float  # pixels at white in the median frame
    underexposed_share: float  # pixels at black in the median frame
    flicker_share: float  # neighbouring frames that show the same surface more than half a stop brighter or darker
    pose_jumps: int
    largest_jump_m: float
    pair_error_mm: float | None  # median disagreement of the depth of neighbouring frames; None: no overlap
    pair_overlap: float  # share of a frame's pixels its neighbour sees too
    drift_mm: float | None  # displacement of the same surface between two visits; None: none is revisited
    poses_source: str
    up_source: str
    up_spread_deg: float | None
    up_file_off_deg: float | None  # of the file's gravity, from what its level and upright planes say
    up_corrected: bool  # whether the planes were taken in its place
    up_rival: tuple[float, float, float] | None  # in the recording's world, if its images lie on their side; None: ruled out
    floor_found: bool
    floor_source: str | None
    floor_spread_mm: float | None
    manhattan_yaw_deg: float
    yaw_source: str
    yaw_spread_deg: float | None
    walls: int
    walls_source: str
    wall_spread_mm: tuple[float, ...]  # of each wall's surface about its plane
    camera_height_m: float | None  # above the floor
    level_heights_m: tuple[float, ...]  # of large level surfaces above the floor
    room_height_m: float | None  # where a ceiling was seen
    seen_from_three: float  # share of the seen surface that is seen from three directions, 10 deg apart
    seen_close: float  # share of it that is seen from within 2 m
    voxel_mm: float
    surface_m: tuple[float, float, float]  # extent of the fused surface along x, y, z


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """Measures of one examined frame."""

    frame_index: int
    sharpness: float  # over the median frame's
    depth_share: float  # of its pixels have usable depth
    brightness: float  # mean, 0 to 1
    error_mm: float | None  # disagreement of its depth with a later neighbour's; None: too little overlap


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureReport:
    """The doctor's report."""

    format: str  # of the recording
    verdict: Verdict
    remarks: tuple[Remark, ...]  # worst first
    figures: CaptureFigures
    moments: tuple[Moment, ...]
    convention: Finding | None  # another way to read the poses that fits better
    scale: Finding | None  # another scale of depth or focal length that fits better
    registration: Registration | None  # how depth lies on colour; None: too few edges in depth to tell
    notices: tuple[str, ...]  # from the reader

    @property
    def reasons(self) -> tuple[str, ...]:
        """One line for each remark, worst first."""
        return tuple(r.line for r in self.remarks)

    def rows(self) -> list[tuple[str, str]]:
        """The measures as table rows: names in words, formatted numbers."""
        return [(name.replace("_", " "), _plain(value)) for name, value in asdict(self.figures).items()]

    def to_json(self) -> dict[str, Any]:
        """The versioned document of `r2c2r info --json`."""
        return {"version": VERSION, **asdict(self), "reasons": list(self.reasons)}


def refusal_to_json(problem: CaptureError) -> dict[str, Any]:
    """The same document for an unreadable recording: a verdict and a reason, without measures."""
    remark = Remark(verdict="unusable", cause="unreadable", text=problem.message, advice=problem.hint)
    document = dict.fromkeys(field.name for field in fields(CaptureReport))
    filled = {"verdict": "unusable", "remarks": [asdict(remark)], "reasons": [remark.line], "notices": [], "moments": []}
    return {"version": VERSION, **document, **filled}


def _plain(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return ", ".join(_plain(part) for part in value) or "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
