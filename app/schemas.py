"""What goes over the wire. Times are seconds since 1970; lengths are metres; pixels are of the stored RGB frame."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

JobState = Literal["queued", "running", "cancelling", "cancelled", "failed", "done"]
JobKind = Literal["import", "sample", "run"]
LiveState = Literal["off", "starting", "preparing", "ready", "failed"]
SegmentState = Literal["none", "waiting", "running", "partial", "done", "failed"]


class Shape(BaseModel):
    """Unknown fields are a mistake of the sender, not a wish."""

    model_config = ConfigDict(extra="forbid", json_schema_serialization_defaults_required=True)


class ErrorBody(Shape):
    """The one shape of an error; `current` is what is stored now when the kind is `conflict`."""

    kind: str
    message: str
    hint: str = ""
    current: Any = None


class Category(Shape):
    """One line of the category table."""

    name: str
    label: str
    joint: str  # revolute | prismatic | none


class Backend(Shape):
    """One way to do a stage's work."""

    name: str
    summary: str
    licence: str
    licence_class: Literal["open", "restricted"]
    available: bool
    reason: str  # why not, and the next step


class SystemInfo(Shape):
    """What the app can do here; limits are shown before a file is chosen."""

    version: str
    user: str
    max_upload_bytes: int
    free_bytes: int
    import_roots: list[str]
    categories: list[Category]
    palette: list[str]  # colours by object.colour, "#rrggbb"
    viewer: bool
    segmenters: list[Backend]  # the first needs nothing and is the default


class FolderEntry(Shape):
    """One line of a folder that a recording may be taken from."""

    name: str
    path: str
    folder: bool
    size: int | None


class FolderListing(Shape):
    """A folder below an allowed root."""

    path: str
    parent: str | None
    entries: list[FolderEntry]


class CaptureRemark(Shape):
    """One thing that is wrong with a recording, how much it matters, and what to do."""

    verdict: str  # good | usable with care | unusable
    cause: str
    text: str
    advice: str


class CaptureMoment(Shape):
    """What one of the frames that the doctor looked at is like."""

    frame_index: int
    sharpness: float  # over the median frame's
    depth_share: float
    brightness: float
    error_mm: float | None  # disagreement of its depth with a later frame's


class CaptureFigure(Shape):
    """One measured figure, as a person reads it."""

    name: str
    value: str


class CaptureFacts(Shape):
    """What the recording is: shown before any work starts. Pictures: /media/{project}/scan/plan.png and view.png."""

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


class FrameInfo(Shape):
    """One frame; `index` is its number in the recording. Image: /media/{project}/frames/{index}.jpg?w=960&v={media_version}."""

    index: int
    timestamp_s: float | None
    width: int
    height: int
    sharpness: float
    camera: list[float]  # position in the world frame, metres


class StageState(Shape):
    """One stage of a job."""

    name: str
    state: Literal["waiting", "running", "done", "failed", "cancelled"]


class Job(Shape):
    """One piece of heavy work."""

    id: int
    project: str
    project_name: str
    kind: JobKind
    state: JobState
    stage: str
    stage_fraction: float
    stages: list[StageState]
    progress: float  # 0..1 over all stages
    eta_s: float | None
    message: str
    error: ErrorBody | None
    position: int | None  # in the queue, 1 is next
    attempts: int
    who: str
    has_log: bool
    created: float
    started: float | None
    finished: float | None


class JobEvent(Shape):
    """One line of a job's history."""

    id: int
    at: float
    kind: str
    stage: str
    fraction: float
    text: str


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


class ProjectCounts(Shape):
    """What is in a project."""

    objects: int = 0
    points: int = 0
    accepted: int = 0
    rejected: int = 0


class Project(Shape):
    """One recording and what became of it."""

    id: str
    name: str
    status: Literal["importing", "failed", "ready"]
    created: float
    updated: float
    source_name: str
    media_version: str
    capture: CaptureFacts | None
    notices: list[str]
    error: ErrorBody | None
    counts: ProjectCounts
    job: Job | None  # the one under way, else the last one
    result: Literal["none", "stale", "current"]  # stale: something was changed since the last run
    bundle: Bundle | None  # the newest
    thumbnail: str | None
    size_bytes: int
    segmenter: str  # draws the masks


class ProjectPatch(Shape):
    """What changes: its name, or which segmenter draws its masks."""

    name: str | None = Field(default=None, min_length=1, max_length=120)
    segmenter: str | None = Field(default=None, max_length=60)


class ImportPath(Shape):
    """A recording on this machine."""

    path: str = Field(min_length=1, max_length=4096)
    name: str | None = Field(default=None, max_length=120)


class SampleRequest(Shape):
    """A synthetic kitchen."""

    seed: int = Field(default=0, ge=0, le=1_000_000)
    frames: int = Field(default=90, ge=10, le=600)
    width: int = Field(default=960, ge=160, le=1920)
    height: int = Field(default=720, ge=120, le=1440)
    name: str | None = Field(default=None, max_length=120)


class Deleted(Shape):
    """What deleting freed."""

    freed_bytes: int


class PointIn(Shape):
    """A click. Outside the frame is refused."""

    frame: int = Field(ge=0, lt=2**31)
    x: float = Field(allow_inf_nan=False)
    y: float = Field(allow_inf_nan=False)
    label: Literal[0, 1] = 1


class PointPatch(Shape):
    """A moved or flipped click."""

    x: float | None = Field(default=None, allow_inf_nan=False)
    y: float | None = Field(default=None, allow_inf_nan=False)
    label: Literal[0, 1] | None = None


class Point(Shape):
    """A stored click."""

    id: int
    frame: int
    x: float
    y: float
    label: Literal[0, 1]


class ObjectIn(Shape):
    """A new object; without a name it gets its category's and the next number."""

    name: str | None = Field(default=None, max_length=60)
    category: str = Field(default="object", min_length=1, max_length=60)
    points: list[PointIn] = Field(default_factory=list, max_length=100)


class ObjectPatch(Shape):
    """What changes; with `version`, only if nobody changed it meanwhile."""

    name: str | None = Field(default=None, max_length=60)
    category: str | None = Field(default=None, min_length=1, max_length=60)
    colour: int | None = Field(default=None, ge=0, le=999)
    version: int | None = None


class SceneObject(Shape):
    """One object a person named."""

    id: int
    project: str
    name: str
    category: str
    colour: int
    version: int
    deleted: bool
    points: list[Point]
    can_undo: bool
    can_redo: bool
    segment: SegmentState
    mask_frames: int
    mask_backend: str  # the segmenter that drew the masks; empty while there are none
    notices: list[str]
    saved: float  # when the last change was stored


class UndoRequest(Shape):
    """What to undo or redo: the last change of this object, or of any object when None."""

    object: int | None = Field(default=None, ge=0, lt=2**63)
    scope: Literal["prompts", "review"] = "prompts"


class Undone(Shape):
    """What was undone or redone, so that the page can say it."""

    object: SceneObject
    text: str
    frame: int | None


class HistoryEntry(Shape):
    """Who changed what, when."""

    id: int
    object: int | None
    scope: str
    action: str
    text: str
    frame: int | None
    who: str
    at: float
    undone: bool


class PromptsFile(Shape):
    """prompts.json."""

    version: Literal[1]
    objects: list["PromptsFileObject"] = Field(max_length=10_000)


class PromptsFileObject(Shape):
    """One object of prompts.json."""

    name: str = Field(max_length=60)
    category: str = Field(max_length=60)
    points: list["PromptsFilePoint"] = Field(max_length=1000)


class PromptsFilePoint(Shape):
    """One click of prompts.json."""

    frame: int = Field(ge=0, lt=2**31)
    x: float = Field(allow_inf_nan=False)
    y: float = Field(allow_inf_nan=False)
    label: Literal[0, 1]


class MaskBits(Shape):
    """A mask at preview size: base64 of zlib of the bits of its box, row by row without padding, high bit first."""

    width: int
    height: int
    left: int
    top: int
    box_width: int
    box_height: int
    bits: str


class FrameMask(Shape):
    """One object's mask on one frame."""

    object: int
    frame: int
    confidence: float
    source: Literal["live", "run"]
    mask: MaskBits


class LaneEntry(Shape):
    """An object on one frame of the film-strip."""

    frame: int
    area: float  # share of the image
    confidence: float


class Lane(Shape):
    """Where an object is seen."""

    object: int
    state: SegmentState
    source: Literal["live", "run", "none"]
    complete: bool
    frames: list[LaneEntry]


class LiveStatus(Shape):
    """The project's live segmenter."""

    state: LiveState
    fraction: float
    text: str
    error: ErrorBody | None


class Proposal(Shape):
    """An object that nobody clicked yet; confirming it adds this click under this category."""

    id: str
    kind: Literal["front", "appliance", "thing"]
    category: str
    confidence: float
    frame: int  # the one that shows it best
    x: float
    y: float
    size_m: list[float]  # width, depth, height
    outline: list[tuple[float, float]]  # in pixels of the stored frame
    handle: list[tuple[float, float]]  # its corners there; empty where none was found


class Proposals(Shape):
    """What is proposed now: dismissed ones and those that became objects are left out."""

    state: Literal["none", "running", "done"]
    fraction: float
    items: list[Proposal]
    dismissed: int


class ProposalIds(Shape):
    """Which proposals are meant."""

    ids: list[str] = Field(min_length=1, max_length=500)


class RunRequest(Shape):
    """Which backends, where not the defaults."""

    segmenter: str | None = Field(default=None, max_length=60)
    generator: str | None = Field(default=None, max_length=60)
    matcher: str | None = Field(default=None, max_length=60)
    seed: int = Field(default=0, ge=0, lt=2**31)


class Candidate(Shape):
    """One candidate mesh with its evidence."""

    id: str
    generator: str
    seed: int
    watertight: bool
    faces: int
    frames: list[int]
    metrics: dict[str, float]
    parameters: dict[str, float]
    warnings: list[str]
    verdict: Literal["accepted", "rejected"] | None
    verdict_reason: str
    verdict_by: str
    glb: str
    thumbnail: str


class Placement(Shape):
    """Where the chosen candidate stands, with the evidence for it."""

    candidate: str
    scale: float
    translation_m: list[float]
    matches: int
    inliers: int
    rms_m: float
    mask_iou: float
    condition: float
    unsure: bool
    runner_up: float | None
    method: str
    votes: dict[int, int]
    warnings: list[str]


class CandidateGroup(Shape):
    """All candidates of one object, the automatic choice and its reason, and what people said."""

    object: int
    name: str
    category: str
    chosen: str
    chosen_by: str
    reason: str
    ranking: list[str]
    accepted: str | None
    candidates: list[Candidate]
    placement: Placement | None
    override: "OverrideData"
    can_undo: bool
    can_redo: bool


class VerdictIn(Shape):
    """What a reviewer says. Rejecting makes new candidates; accepting another one aligns it anew."""

    candidate: str = Field(min_length=1, max_length=60)
    verdict: Literal["accepted", "rejected", "cleared"]
    reason: str = Field(default="", max_length=500)
    rerun: bool = True


class OverrideData(Shape):
    """What a person corrected about one object; None is computed."""

    candidate: str | None = None
    hinge: Literal["left", "right", "top", "bottom"] | None = None
    dimensions_m: tuple[float, float, float] | None = None
    pose: list[list[float]] | None = None  # world_from_object, 4x4
    joint_lower: float | None = None
    joint_upper: float | None = None
    rejected: list[str] = Field(default_factory=list)


class OverridePatch(Shape):
    """The fields that are present are set; null clears."""

    candidate: str | None = None
    hinge: Literal["left", "right", "top", "bottom"] | None = None
    dimensions_m: tuple[float, float, float] | None = None
    pose: list[list[float]] | None = None
    joint_lower: float | None = Field(default=None, allow_inf_nan=False)
    joint_upper: float | None = Field(default=None, allow_inf_nan=False)
    rerun: bool = True


class Reviewed(Shape):
    """The object after a verdict or a correction, and the job that follows from it."""

    group: CandidateGroup | None
    job: Job | None
    text: str


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
    seconds: float


class SceneSummary(Shape):
    """The finished scene as a table."""

    items: list[SceneItem]
    failures: dict[str, str]  # object name -> why it is missing
    warnings: list[str]
    stages: list[StageInfo]
    glb: str | None
    preview: str | None


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


class ViewerSession(Shape):
    """Where the 3D view of a project is; `fallback` when it is down."""

    state: Literal["ready", "down"]
    url: str | None  # for the iframe, ends in a slash
    message: str
    fallback_page: str | None  # the bundle's own 3D page
    fallback_image: str | None


class ViewerShow(Shape):
    """What the 3D view shows."""

    mode: Literal["cloud", "candidate", "aligned", "scene"]
    object: int | None = Field(default=None, ge=0, lt=2**63)
    candidate: str | None = Field(default=None, max_length=60)
    cloud: bool = True  # the scan behind it
    opacity: float = Field(default=1.0, ge=0.0, le=1.0)
    collision: bool = False  # colliders instead of what is seen (scene only)
    full: bool = False  # every point and face, whatever it costs


class ViewerJoint(Shape):
    """One joint of the scene the 3D view shows."""

    name: str
    lower: float
    upper: float
    value: float


class ViewerShown(Shape):
    """What the 3D view shows now."""

    mode: str
    text: str
    joints: list[ViewerJoint]


class JointValues(Shape):
    """Joint positions; they are clamped to the limits."""

    values: dict[str, float]
