"""Model of a bundle's manifest.json: the provenance of every number. The writer is export/manifest.py."""

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, Strict

from r2c2r_core.model.contradiction import ContradictionRule
from r2c2r_core.model.handle import HandleKind
from r2c2r_core.model.motion import Source
from r2c2r_core.model.scene import GripPart
from r2c2r_core.schema.document import Document
from r2c2r_core.schema.prompts import PromptsFilePoint, Version

_Three: TypeAlias = Annotated[tuple[float, float, float], Strict(False)]
_Row: TypeAlias = Annotated[tuple[float, float, float, float], Strict(False)]
_Pose: TypeAlias = Annotated[tuple[_Row, _Row, _Row, _Row], Strict(False)]
_Rotation: TypeAlias = Annotated[tuple[_Three, _Three, _Three], Strict(False)]
_Sources: TypeAlias = Annotated[tuple[Source, Source, Source], Strict(False)]


class ManifestCapture(Document):
    """The recording."""

    name: str = Field(description="the recording's name")
    sha256: str = Field(description="identity of the recording: of the zip itself, or of its files")
    format: str = Field(description="the format it was read as")
    frames: int = Field(ge=0, description="how many of its frames were used")


class ManifestJointSource(Document):
    """Where a joint's numbers come from."""

    axis: Source = Field(description="measured, inferred, default or person")
    origin: Source = Field(description="measured, inferred, default or person")
    lower: Source | None = Field(default=None, description="of the lower limit: person; null where it is 0, the closed state")
    limits: Source = Field(
        description="of the upper limit: at_least (as far as it was seen to open), inferred, default or person"
    )


class ManifestBlocker(Document):
    """An obstacle that keeps a joint from opening completely."""

    name: str = Field(description="an object, or another joint")
    kind: Literal["thing", "joint"] = Field(description="thing or joint")
    position: float = Field(description="rad or m of the blocked joint at which they meet")


class ManifestState(Document):
    """Where a front stood in a frame that shows it."""

    frame: int = Field(ge=0, description="the frame's number in the recording")
    value: float | None = Field(description="rad or m, 0 is closed; null where it is in view and not known")
    sigma: float | None = Field(description="its standard deviation, rad or m")


class ManifestInside(Document):
    """Clear interior lengths in m, observed behind an open front; null where not observed."""

    depth_m: float | None = Field(description="from the back of the closed front to the face of the rear board")
    width_m: float | None = Field(description="between the sides")
    height_m: float | None = Field(description="from the bottom to the rim of a drawer's sides, or to the top board")
    shelves_m: list[float] = Field(description="upper faces of the shelves above the bottom's face")
    board_m: float | None = Field(description="thickness of the sides")
    front_m: float | None = Field(description="thickness of the front")


class ManifestMotion(Document):
    """The joint as it was filmed."""

    source: Source = Field(description="of axis and origin: measured, inferred or person")
    covariance: list[list[float]] | None = Field(
        description="6x6: of a small rotation of the axis about the world's axes (rad), then of the origin (m)"
    )
    largest: float = Field(description="the widest state seen, rad or m")
    states: list[ManifestState] = Field(description="one of every frame that shows the front")
    inside: ManifestInside | None = Field(description="what was seen behind it")


class ManifestRange(Document):
    """How far a number may be varied for training."""

    distribution: Literal["uniform", "loguniform", "normal"] = Field(
        description="uniform or loguniform between the ends; normal: about the written value, cut off at them"
    )
    low: float = Field(description="the least, in the number's unit")
    high: float = Field(description="the most")
    sigma: float | None = Field(description="standard deviation of a normal distribution; null of another")
    source: Literal["measured", "sourced", "default"] = Field(
        description="whether its spread was measured, published or chosen"
    )
    why: str = Field(description="by what")


class ManifestJointRanges(Document):
    """Randomisation ranges of one joint."""

    damping: ManifestRange = Field(description="N m s/rad or N s/m")
    friction: ManifestRange = Field(description="N m or N")
    armature: ManifestRange = Field(description="kg m2 or kg")
    upper: ManifestRange = Field(description="rad or m")


class ManifestObjectRanges(Document):
    """Randomisation ranges of one object."""

    mass_kg: ManifestRange = Field(description="of all its links; scale them together")
    friction: ManifestRange = Field(description="of its surfaces")
    dimensions_m: list[ManifestRange] = Field(min_length=3, max_length=3, description="width, depth, height")
    colour: ManifestRange = Field(description="added to each of red, green and blue, 0 to 1")


class ManifestRoom(Document):
    """Free lengths round a closed handle in m, at most 0.3: every collider of the scene and the floor counted."""

    before_m: float = Field(description="for a hand of 40 x 90 mm that backs off; for a push, a fingertip of 20 mm")
    beside_m: tuple[float, float] = Field(strict=False, description="for a finger, from the grip's faces along -y and +y")
    depth_m: tuple[float, float] = Field(strict=False, description="how deep a finger goes beside it, from its outer face")


class ManifestLabels(Document):
    """Semantic labels of a link or a handle, the same in every format."""

    category: str = Field(description="of its object, as a person called it")
    part: Literal["body", "door", "drawer", "sliding_door", "handle"] = Field(description="what it is to the object")
    disposition: list[Literal["openable", "graspable", "pushable"]] = Field(description="what can be done to it")


class ManifestHandle(Document):
    """Handle of a closed joint, in the world; its frame is that of a gripper grasping it (x, y, z below)."""

    name: str = Field(description="of the site in scene.xml, the prim in scene.usda, the node in scene.glb")
    kind: HandleKind = Field(description="bar (room behind it), knob (solid down to the front) or push (nothing to hold)")
    link: str = Field(description="the link it is a part of")
    labels: ManifestLabels = Field(description="what it means")
    centre: _Three = Field(description="m; of a push: on the front's face, by its free edge")
    axis: _Three = Field(description="unit: x, along the grip or the edge")
    closing: _Three = Field(description="unit: y, the way fingers close")
    approach: _Three = Field(description="unit: z, into the front")
    opening: _Three = Field(description="unit: where the centre first moves as the joint opens")
    size_m: _Three = Field(description="of the grip along x, y (what fingers close on) and z; a push: its edge, 0, 0")
    protrusion_m: float = Field(description="from the front's outer face to the grip's")
    gap_m: float = Field(description="between the grip and the front, where fingers hook in")
    room: ManifestRoom = Field(description="what is free round it")
    source: dict[GripPart, Source] = Field(
        default_factory=dict,
        description="of place (measured in the frames, inferred from the mesh, person; default of a push), protrusion and "
        "thickness (default where nothing measured them)",
    )
    confidence: float | None = Field(default=None, description="that there is a handle here, 0 to 1; null of a push")


class ManifestJoint(Document):
    """One joint; 0 is closed, positive opens by the right-hand rule about or along the axis."""

    name: str = Field(description="the joint's name, which begins with its object's")
    type: Literal["revolute", "prismatic"] = Field(description="revolute or prismatic")
    axis: _Three = Field(description="a unit vector in the world")
    origin: _Three = Field(description="a point on the axis, in m, in the world")
    lower: float = Field(description="rad or m")
    upper: float = Field(description="rad or m")
    uncut: float | None = Field(
        default=None, description="the upper end before an obstacle cut it short; null where nothing did"
    )
    source: ManifestJointSource = Field(description="where its numbers come from")
    confidence: float | None = Field(description="of the hinge's side, 0 to 1; null where there is no choice")
    motion: ManifestMotion | None = Field(default=None, description="as it was filmed; null where it was not seen to move")
    blocked_by: list[ManifestBlocker] = Field(default_factory=list, description="what is in its way when it opens")
    randomize: ManifestJointRanges | None = Field(default=None, description="how far its numbers may be varied")
    handles: list[ManifestHandle] = Field(default_factory=list, description="what it is opened with")


class ManifestMask(Document):
    """The evidence in the frames."""

    frames: int = Field(ge=0, description="frames with a mask")
    mean_area_px: float = Field(ge=0, description="mean area of a mask in px")
    prompts: list[PromptsFilePoint] = Field(description="the clicks it comes from")


class ManifestCandidate(Document):
    """A mesh that was proposed."""

    id: str = Field(description="the candidate's id")
    generator: str = Field(description="the backend that made it")
    seed: int = Field(description="the seed it was drawn with")
    assumes: str = Field(description="assumption about its unobserved part; empty: a sample of a generator")
    metrics: dict[str, float | None] = Field(description="what was measured of it, by name")


class ManifestChoice(Document):
    """The chosen candidate."""

    candidate: str = Field(description="the candidate's id")
    by: str = Field(description="consensus or person")
    at: str | None = Field(description="when a person chose; null otherwise")


class ManifestSpread(Document):
    """By how much a pose may be off: standard deviations."""

    turn_deg: float | None = Field(description="deg, about the least constrained axis")
    shift_m: float | None = Field(description="m, along the least constrained direction")
    scale: float | None = Field(description="share of the size")


class ManifestPlacement(Document):
    """Where the candidate stands, and the evidence for it."""

    scale: float = Field(description="m per unit of the mesh")
    rotation: _Rotation = Field(description="3x3, world from mesh")
    translation: _Three = Field(description="m, world from mesh")
    inliers: int = Field(ge=0, description="matches that agree")
    rms_m: float | None = Field(description="residual in m; null without depth inside the masks")
    mask_iou: float | None = Field(description="overlap of its outline with the masks, 0 to 1")
    unsure: bool = Field(description="whether another pose fits about as well")
    runner_up_turn_deg: float | None = Field(description="how far that other pose is turned, in deg")
    spread: ManifestSpread | None = Field(description="by how much the pose may be off")


class ManifestWarp(Document):
    """How the mesh was fitted to what was built."""

    residual_m: float | None = Field(description="m; null where the primitive is shown")
    paper_residual_m: float | None = Field(description="m, of the paper's affine map; null where it was not asked for")


class ManifestScanFit(Document):
    """The mesh beside the scan."""

    median_m: float | None = Field(description="m, from scan to mesh")
    p95_m: float | None = Field(description="m, 95 % of the scan is nearer")
    f_score_1cm: float | None = Field(description="0 to 1, at 1 cm")
    f_score_2cm: float | None = Field(description="0 to 1, at 2 cm")
    points: int = Field(ge=0, description="points of the scan that were compared")


class ManifestSeen(Document):
    """How much of its surface the frames saw; the rest is a guess. The underside does not count."""

    share: float = Field(ge=0, le=1, description="of all sides together, by their area")
    sides: dict[Literal["front", "back", "left", "right", "top"], float] = Field(
        description="of each side of its box, 0 to 1; one that shows nothing of it is left out"
    )
    unseen: list[Literal["front", "back", "left", "right", "top"]] = Field(
        description="sides of which less than a quarter was seen"
    )


class ManifestMeshes(Document):
    """Files of the bundle."""

    visual: list[str] = Field(description="paths of what is seen")
    collision: list[str] = Field(description="paths of colliders that are no boxes")


class ManifestObject(Document):
    """One object of the scene."""

    name: str = Field(description="the object's name")
    category: str = Field(description="as a person called it")
    fixture: str = Field(description="as what it was built")
    dimensions_m: _Three = Field(description="[width, depth, height] in m, without the handle")
    world_from_object: _Pose = Field(description="4x4; origin at the box's centre, front at -Y, +Z up")
    joint: ManifestJoint | None = Field(description="the first of its joints; null where nothing moves")
    joints: list[ManifestJoint] = Field(description="all of its joints")
    labels: dict[str, ManifestLabels] = Field(default_factory=dict, description="what each of its links means")
    movable: bool = Field(description="whether it stands free")
    carried_by: str | None = Field(default=None, description="the link of a drawer that it lies in; null elsewhere")
    dimension_source: _Sources = Field(description="where width, depth and height come from")
    inside_source: dict[Literal["depth", "shelves"], Source] = Field(
        default_factory=dict,
        description="where what its fronts close comes from: measured, seen behind an open front; default, its category's",
    )
    layout_move_m: float | None = Field(description="m by which the layout moved it")
    mask: ManifestMask | None = Field(description="null for parts made from the scan without clicks")
    candidates: list[ManifestCandidate] = Field(description="meshes that were proposed")
    chosen: ManifestChoice | None = Field(description="null for parts made from the scan without clicks")
    placement: ManifestPlacement | None = Field(description="null for parts made from the scan without clicks")
    warp: ManifestWarp = Field(description="how the mesh was fitted")
    scan_fit: ManifestScanFit | None = Field(description="the mesh beside the scan; null where it was not seen")
    seen: ManifestSeen | None = Field(default=None, description="what was seen of it; null where that is not known")
    meshes: ManifestMeshes = Field(description="its files")
    mass_kg: float = Field(gt=0, description="kg of all its links")
    randomize: ManifestObjectRanges | None = Field(default=None, description="how far its numbers may be varied")
    warnings: list[str] = Field(description="warnings of all stages about it")


class ManifestContradiction(Document):
    """A contradiction between prompts."""

    rule: ContradictionRule = Field(description="what kind of contradiction")
    objects: list[str] = Field(min_length=1, description="names of those concerned")
    message: str = Field(description="what contradicts what, at which clicks")
    mend: str = Field(description="what a person can do")


class ManifestStage(Document):
    """How a stage was run."""

    name: str = Field(description="the stage")
    backend: str = Field(description="the backend that did it")
    config: dict[str, Any] = Field(description="its settings; see `r2c2r schema config`")
    seconds: float = Field(default=0.0, ge=0, description="how long it took")


class Manifest(Document):
    """manifest.json."""

    schema_: Version = Field(alias="schema", description="1, the current format")
    tool_version: str = Field(description="the version of r2c2r that wrote it")
    created: str | None = Field(description="ISO 8601; null if no time was given, so that equal inputs give equal bytes")
    capture: ManifestCapture = Field(description="the recording")
    world_from_capture: _Pose = Field(description="4x4: the levelled world from the recording's own")
    objects: list[ManifestObject] = Field(description="what the scene holds")
    states: dict[str, dict[str, float]] = Field(
        default_factory=dict,
        description="where each joint stands in closed, ajar, open (those that can be open at once) and JOINT_open: the "
        "keyframes of scene.xml",
    )
    contradictions: list[ManifestContradiction] = Field(
        default_factory=list, description="what the segmenter's masks, sizes and places contradict"
    )
    stages: list[ManifestStage] = Field(description="how each stage was run")
    files: dict[str, str] = Field(default_factory=dict, description="SHA-256 of every other file, by its path in the bundle")
