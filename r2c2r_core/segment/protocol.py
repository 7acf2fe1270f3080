"""The protocol every segmenter satisfies, and its settings."""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from r2c2r_core.arrays import Mask
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.elevation import Elevation
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.model.track import FrontPanel, MaskTrack, ThingBox
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.schema.settings import setting, tuned_numbers
from r2c2r_core.tuning import Changes

Fusion = Literal["none", "depth-mask", "evidence"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentConfig:
    """Settings of segmentation. Lengths are in metres, so that they hold for any camera."""

    cell_m: float = setting(0.0025, "cell size of the orthomosaic, in m: about a pixel of a phone at 2 m", ge=0.0005, le=0.1)
    # more add smear, not evidence (real kitchen: 24 and 48 cut alike)
    mosaic_frames: int = setting(24, "maximum number of frames in a front's orthomosaic", ge=1, le=1000)
    least_area_px: int = setting(60, "minimum number of visible pixels of an object in a frame", ge=0, le=10**6)
    weights: str = setting(
        "", "learned segmenter's weights, folder or hub id; empty: R2C2R_<NAME>_WEIGHTS, else its default", max_length=4000
    )
    fusion: Fusion = setting("evidence", "none, depth-mask (as in the paper) or evidence: how depth corrects learned masks")
    params: Changes = tuned_numbers("segment")


Glimpse = tuple[int, PackedMask, float]
"""Frame, mask and confidence."""


class SegmentSession(Protocol):
    """A capture prepared for clicks. The track of one object depends on another's prompt only through `ObjectPrompt.others`."""

    def disputed(self, prompts: Sequence[ObjectPrompt]) -> dict[str, tuple[PromptPoint, ...]]:
        """Clicks of other objects that hit an object, by its name; objects without any are left out."""

    def mask_at(self, prompt: ObjectPrompt, frame_index: int) -> Mask:
        """Mask of the object in one frame, at RGB resolution; empty when that frame does not show it."""

    def glimpse(self, prompt: ObjectPrompt) -> Glimpse | None:
        """Preview mask, perhaps coarser, in the frame clicked last, while another thread may be streaming.

        None when `stream` yields its first mask as soon, or that frame does not show the object.
        """

    def prepare(self, *, progress: Progress = SILENT) -> None:
        """Compute and cache everything that a click may need, so that clicks do not wait."""

    def prefetch(self) -> Iterator[None]:
        """Load the data that clicks will need, bit by bit, as far as memory allows; for idle time."""

    def track(self, prompt: ObjectPrompt, *, progress: Progress = SILENT) -> MaskTrack:
        """Mask track of the object over all frames that see it, with its measurements; raises ObjectNotSeen."""

    def stream(self, prompt: ObjectPrompt) -> Iterator[Glimpse]:
        """Frame, mask and confidence: the frame clicked last, then outwards both ways; only frames that see the object."""

    def elevations(self) -> Iterator[Elevation]:
        """Elevations of the capture's planes, on which a person draws fronts."""

    def panel(self, prompt: ObjectPrompt) -> FrontPanel | None:
        """Flat front of a streamed object; None where it has none, or is not measured yet."""

    def thing_box(self, prompt: ObjectPrompt) -> ThingBox | None:
        """Box of a streamed free-standing object; None for other objects, or where it is not measured yet."""

    def motions(self, prompt: ObjectPrompt) -> tuple[JointMotion, ...]:
        """Joint motions of the leaves of a streamed object; none where they are not measured yet."""

    def propose(self) -> Iterator[tuple[float, tuple[Proposal, ...]]]:
        """Proposals so far, the most confident first, with the fraction of the work done; the last step has them all."""


class Segmenter(Protocol):
    """A backend; each names this class as its base, so that the type checker compares them."""

    @abstractmethod
    def open(self, capture: Capture, cache: Path, config: SegmentConfig, *, progress: Progress = SILENT) -> SegmentSession:
        """Prepare a capture; heavy results are stored in `cache` and reused."""
