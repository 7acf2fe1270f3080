"""Capture + prompts -> mask tracks (paper 4.1)."""

from collections.abc import Sequence
from pathlib import Path

from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.registry import Backend, Registry, Weights
from r2c2r_core.segment.corrected import corrected_track
from r2c2r_core.segment.protocol import SegmentConfig, Segmenter, SegmentSession

__all__ = ["SEGMENTERS", "SegmentConfig", "find_disputed", "open_session", "track_object"]

SEGMENTERS: Registry[Segmenter] = Registry(
    "segmenter",
    group="r2c2r.segmenters",
    protocol=Segmenter,
    own=(
        Backend(
            name="geometric",
            target="r2c2r_core.segment.geometric.session:GeometricSegmenter",
            summary="no weights: fronts are found on an orthomosaic of each furniture run, objects in the fused surface",
        ),
        Backend(
            name="sam2",
            target="r2c2r_core.segment.learned.session:Sam2Segmenter",
            extra="learned",
            needs=("torch", "transformers"),
            weights=Weights(usual="facebook/sam2.1-hiera-tiny", variable="R2C2R_SAM2_WEIGHTS"),
            licence="Apache-2.0 (SAM 2.1, code and weights)",
            summary="SAM 2.1: masks followed through the video; a GPU makes it quick",
        ),
        Backend(
            name="edgetam",
            target="r2c2r_core.segment.learned.session:EdgeTamSegmenter",
            extra="edgetam",
            needs=("torch", "transformers", "timm", "torchvision"),
            weights=Weights(usual="yonigozlan/EdgeTAM-hf", variable="R2C2R_EDGETAM_WEIGHTS"),
            licence="Apache-2.0 (EdgeTAM, code and weights)",
            summary="EdgeTAM: a small SAM 2 for machines without a GPU",
        ),
        Backend(
            name="sam3",
            target="r2c2r_core.segment.learned.session:Sam3Segmenter",
            extra="learned",
            needs=("torch", "transformers"),
            weights=Weights(usual="facebook/sam3", variable="R2C2R_SAM3_WEIGHTS", gated=True),
            licence="SAM License (gated weights; commercial use allowed, military use not)",
            licence_class="restricted",
            summary="SAM 3's tracker: the largest, for a GPU",
        ),
    ),
)


def open_session(
    capture: Capture,
    cache: Path,
    segmenter: str = SEGMENTERS.default,
    config: SegmentConfig | None = None,
    *,
    progress: Progress = SILENT,
) -> SegmentSession:
    """Session of a capture prepared for clicks; heavy results live in `cache`."""
    config = config or SegmentConfig()
    return SEGMENTERS.load(segmenter, weights=config.weights).open(capture, cache, config, progress=progress)


def find_disputed(
    session: SegmentSession, prompts: Sequence[ObjectPrompt], *, progress: Progress = SILENT
) -> dict[str, tuple[PromptPoint, ...]]:
    """Clicks of other objects that hit an object, by its name: between two names there is a seam."""
    return session.disputed(prompts)


def track_object(session: SegmentSession, prompt: ObjectPrompt, *, progress: Progress = SILENT) -> MaskTrack:
    """Mask track of the object over all frames that see it, with a person's corrections; raises ObjectNotSeen, PromptError."""
    return corrected_track(session.track(prompt, progress=progress), prompt.frames)
