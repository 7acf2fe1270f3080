"""A recording, levelled: posed frames and what the whole room looks like."""

from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from r2c2r_core.arrays import Colours, DepthMetres, Faces, Image, Mask, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3


class Depth(NamedTuple):
    """Depth at the sensor's own resolution. Never filled: `metres` is 0 where `valid` is False."""

    metres: DepthMetres
    valid: Mask


class FrameImages(Protocol):
    """Where the pixels of a capture are; keyed by Frame.index. Implementations read from disk on demand."""

    def rgb(self, frame_index: int) -> Image:
        """The colour image, at its stored resolution."""

    def depth(self, frame_index: int) -> Depth:
        """The depth image, at its stored resolution, after confidence and flying-pixel rejection."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """One posed RGB-D frame."""

    index: int  # the frame's number in the recording (never its position in a sorted list)
    timestamp_s: float | None
    rgb_camera: Intrinsics
    depth_camera: Intrinsics
    world_from_camera: Rigid3  # colour and depth share it (readers register them)
    sharpness: float  # variance of the Laplacian at 320 px width; only its order means something


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """What stands still: gravity, floor, walls. The world is levelled, so up is +Z and the floor, if found, z = 0."""

    up_source: Literal["file", "floor", "person", "assumed"]
    floor_found: bool
    manhattan_yaw_rad: float  # in [0, pi/2): world yaw of one of the two dominant horizontal directions
    walls: tuple["Wall", ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wall:
    """A large vertical plane: normal @ x = offset, the normal pointing into the room."""

    normal: Vector3
    offset_m: float
    area_m2: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoseEvidence:
    """Where the poses come from, and how far frames that see one place at different times disagree (median, metres)."""

    source: Literal["file", "refined", "odometry"]
    given_gap_m: float | None  # with the recording's own poses; None: it has none, or no place was seen twice
    gap_m: float | None  # with the poses used


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneSurface:
    """The fused scan in the world frame."""

    vertices_world: Points
    faces: Faces
    colours: Colours
    voxel_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Capture:
    """A levelled recording."""

    name: str
    sha256: str
    format: str
    frames: tuple[Frame, ...]
    world_from_capture: Rigid3
    room: Room
    surface: SceneSurface
    images: FrameImages
    notices: tuple[str, ...]  # one line each, for a person
    poses: PoseEvidence | None = None  # None: not examined

    def frame(self, frame_index: int) -> Frame:
        """The frame with that number; KeyError when the recording lacks it."""
        for frame in self.frames:
            if frame.index == frame_index:
                return frame
        raise KeyError(frame_index)
