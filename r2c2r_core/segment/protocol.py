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


class SegmentSession(Protocol):
    """A capture made ready for clicks. The track of one object never depends on another's prompt."""

    def mask_at(self, prompt: ObjectPrompt, frame_index: int) -> Mask:
        """The object's mask in one frame, at RGB resolution; empty when that frame does not show it."""

    def track(self, prompt: ObjectPrompt, *, progress: Progress = SILENT) -> MaskTrack:
        """The object in every frame that sees it, and what was measured; raises ObjectNotSeen."""

    def stream(self, prompt: ObjectPrompt) -> Iterator[tuple[int, PackedMask, float]]:
        """Frame, mask and confidence: the clicked frame first, then outwards both ways; only frames that see the object."""

    def propose(self) -> Iterator[tuple[float, tuple[Proposal, ...]]]:
        """Objects to confirm, surest first, found so far with the share of the work done; the last step has them all."""


class Segmenter(Protocol):
    """A backend."""

    def open(self, capture: Capture, cache: Path, config: object, *, progress: Progress = SILENT) -> SegmentSession:
        """Prepare a capture; heavy results are kept in `cache` and found again there."""
