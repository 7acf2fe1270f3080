"""What a segmenter is."""

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

from r2c2r_core.arrays import Mask
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress

Glimpse = tuple[int, PackedMask, float]
"""Frame, mask and confidence."""


class SegmentSession(Protocol):
    """A capture made ready for clicks. The track of one object never depends on another's prompt."""

    def mask_at(self, prompt: ObjectPrompt, frame_index: int) -> Mask:
        """The object's mask in one frame, at RGB resolution; empty when that frame does not show it."""

    def glimpse(self, prompt: ObjectPrompt) -> Glimpse | None:
        """A first, perhaps coarser, mask in the frame clicked last, while another thread may be streaming.

        None when `stream` brings its first mask as soon, or that frame does not show the object.
        """

    def prefetch(self) -> Iterator[None]:
        """Load what clicks will need, bit by bit, as far as memory allows; for while nobody waits."""

    def track(self, prompt: ObjectPrompt, *, progress: Progress = SILENT) -> MaskTrack:
        """The object in every frame that sees it, and what was measured; raises ObjectNotSeen."""

    def stream(self, prompt: ObjectPrompt) -> Iterator[Glimpse]:
        """Frame, mask and confidence: the frame clicked last, then outwards both ways; only frames that see the object."""

    def propose(self) -> Iterator[tuple[float, tuple[Proposal, ...]]]:
        """Objects to confirm, surest first, found so far with the share of the work done; the last step has them all."""


class Segmenter(Protocol):
    """A backend."""

    def open(self, capture: Capture, cache: Path, config: object, *, progress: Progress = SILENT) -> SegmentSession:
        """Prepare a capture; heavy results are kept in `cache` and found again there."""
