"""Segmentation of an object over the recording."""

from dataclasses import dataclass
from typing import Literal

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.carrier import Carrier
from r2c2r_core.model.motion import JointMotion, Source, opened_frames
from r2c2r_core.model.rectangle import Rectangle3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrontHandle:
    """A handle on a front, as a box in the front frame: x to the right, z up, both from the front's centre."""

    left_m: float
    right_m: float
    bottom_m: float
    top_m: float
    protrusion_m: float  # protrusion from the front
    confidence: float  # 0..1
    source: Source = "measured"  # of its rectangle: measured in the frames, inferred from a mesh, or a person's
    protrusion_source: Source = "measured"

    @property
    def centre(self) -> tuple[float, float]:
        """(x, z) of its centre, metres."""
        return (self.left_m + self.right_m) / 2, (self.bottom_m + self.top_m) / 2

    @property
    def is_vertical(self) -> bool:
        """Whether it is taller than wide."""
        return self.top_m - self.bottom_m > self.right_m - self.left_m


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrontPanel(Rectangle3):
    """The rectangle of a flat front, measured over all frames."""

    handle: FrontHandle | None
    confidence: float  # 0..1
    roll_rad: float = 0.0  # in-plane tilt that was found and removed (gravity error)
    edges: tuple[float, ...] = ()  # probability of each edge: left, right, top, bottom; empty where a person drew it
    changes: tuple[float, ...] = ()  # CIELAB colour change at each edge, median along it; in the same order
    seam: float = 0.0  # probability of the most likely seam inside it that was not cut
    strip_over_m: float = 0.0  # height of the strip of another material over it, such as a worktop's front edge; 0: none
    slides: float = 0.0  # probability that it slides sideways, over the panel behind it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ThingBox:
    """A free-standing object's gravity-aligned box, measured on its visible points. Frame: `object` (transforms.py)."""

    world_from_object: Rigid3
    dimensions_m: Vector3  # width, depth, height
    support_z_m: float  # world height of its support
    depth_seen: bool = False  # whether an appliance's depth was observed, not assumed
    carrier: Carrier | None = None  # the drawer that it lies in; it is measured where that drawer is closed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MaskTrack:
    """An object's masks at RGB resolution, with the segmenter's measurements."""

    name: str
    category: str
    masks: dict[int, PackedMask]  # by Frame.index; only frames that see the object
    confidence: dict[int, float]  # 0..1, same keys
    front: FrontPanel | None  # set for furniture fronts and, where found, for appliances
    box: ThingBox | None  # set for appliances and free-standing objects
    kind: Literal["front", "appliance", "thing"]
    backend: str
    prompt_count: int
    warnings: tuple[str, ...]
    motions: tuple[JointMotion, ...] = ()  # motion of each leaf filmed open

    @property
    def opened_frames(self) -> frozenset[int]:
        """Frames in which its front, or the drawer that carries it, is not closed."""
        carrier = None if self.box is None else self.box.carrier
        return opened_frames(self.motions if carrier is None else (carrier.motion,))


def at_rest(capture: Capture, track: MaskTrack) -> Capture:
    """Capture in which an object stands still: of one in a drawer, the frames that show it, seen from that drawer."""
    carrier = None if track.box is None else track.box.carrier
    return capture if carrier is None else carrier.capture(capture, track.masks)
