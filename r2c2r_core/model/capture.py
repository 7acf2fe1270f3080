"""A levelled recording: posed frames and the geometry of the whole room."""

from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, Protocol

import numpy as np

from r2c2r_core.arrays import Colours, DepthMetres, Faces, Image, Mask, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.light import NO_GAIN, Gain
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import DepthNoise


class Depth(NamedTuple):
    """Depth at the sensor's own resolution. Never filled: `metres` is 0 where `valid` is False."""

    metres: DepthMetres
    valid: Mask


class FrameImages(Protocol):
    """Pixel access of a capture, keyed by Frame.index. Implementations read from disk on demand."""

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
    gain: Gain = NO_GAIN  # brings the image, stored as recorded, to the recording's common exposure and white balance


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """Static frame of the scene: gravity, floor, walls. The world is levelled, so up is +Z and the floor, if found, z = 0.

    Each quantity comes with its source and its spread: the deviation of the surfaces that could determine it (rms, one sigma),
    whatever its source; None where there are none.
    """

    up_source: Literal["file", "floor", "person", "assumed"]
    up_spread_deg: float | None = None  # deviation of large horizontal and vertical planes
    up_file_off_deg: float | None = None  # angle between the file's gravity and the planes'; None: unknown
    up_corrected: bool = False  # whether the planes' direction replaced the file's
    up_rival_capture: Vector3 | None = None  # up in the capture frame if the images are stored sideways; None: ruled out
    floor_found: bool
    floor_source: Literal["surface", "person"] | None = None  # None: not found
    floor_spread_m: float | None = None  # spread of the surface near that height
    manhattan_yaw_rad: float  # in [0, pi/2): world yaw of one of the two dominant horizontal directions
    yaw_source: Literal["surface", "person", "assumed"] = "surface"
    yaw_spread_deg: float | None = None  # spread of large vertical planes within 4 deg
    walls: tuple["Wall", ...]
    walls_source: Literal["surface", "person"] = "surface"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wall:
    """A large vertical plane: normal @ x = offset, the normal pointing into the room."""

    normal: Vector3
    offset_m: float
    area_m2: float  # area of the observed surface on it
    spread_m: float | None = None  # of that surface about the plane, one sigma; None: nothing was observed there
    span_m: tuple[float, float] | None = None  # interval of a lining along up x normal; None: unbounded


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoseEvidence:
    """Source of the poses, and the median distance in metres between frames that see one place at different times."""

    source: Literal["file", "refined", "odometry"]
    given_gap_m: float | None  # with the recording's own poses; None: it has none, or no place was observed twice
    gap_m: float | None  # with the poses used
    given: np.ndarray | None = None  # (n, 4, 4) world_from_camera as recorded, where others are used instead


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneSurface:
    """The fused scan in the world frame."""

    vertices_world: Points
    faces: Faces
    colours: Colours
    voxel_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scan:
    """A recording before levelling: `world` is the recording's own frame here, with any up direction."""

    name: str
    sha256: str
    format: str
    frames: tuple[Frame, ...]
    surface: SceneSurface
    images: FrameImages
    up_capture: Vector3 | None  # gravity according to the recording
    other_ups: tuple[Vector3, ...] = ()  # alternative interpretations of it
    notices: tuple[str, ...]
    poses: PoseEvidence
    depth_noise: DepthNoise


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
    depth_noise: DepthNoise = field(default_factory=DepthNoise)
    scale: float | None = None  # factor on the recording's lengths when it was read; None: not recorded

    @property
    def as_recorded(self) -> "Capture":
        """The same capture with the recording's own poses, where they were refined."""
        if self.poses is None or self.poses.given is None:
            return self
        given = (Rigid3.from_matrix(matrix) for matrix in self.poses.given)
        return replace(self, frames=tuple(replace(f, world_from_camera=g) for f, g in zip(self.frames, given, strict=True)))

    def frame(self, frame_index: int) -> Frame:
        """The frame with that number; KeyError when the recording lacks it."""
        for frame in self.frames:
            if frame.index == frame_index:
                return frame
        raise KeyError(frame_index)
