"""Capture + prompts -> mask tracks (paper 4.1)."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from r2c2r_core.errors import InputError
from r2c2r_core.model.capture import Capture
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.registry import Backend, Registry, Weights
from r2c2r_core.segment.protocol import SegmentSession

SEGMENTERS = Registry(
    "segmenter",
    (
        Backend(
            name="geometric",
            target="r2c2r_core.segment.geometric:GeometricSegmenter",
            summary="weight-free: fronts cut on an ortho mosaic, things cut from the fused surface",
        ),
        Backend(
            name="sam2",
            target="r2c2r_core.segment.learned:Sam2Segmenter",
            extra="learned",
            needs=("torch", "transformers"),
            weights=Weights(usual="facebook/sam2.1-hiera-tiny", variable="R2C2R_SAM2_WEIGHTS"),
            licence="Apache-2.0 (SAM 2.1, code and weights)",
            summary="SAM 2.1: masks followed through the video; a GPU makes it quick",
        ),
        Backend(
            name="edgetam",
            target="r2c2r_core.segment.learned:EdgeTamSegmenter",
            extra="edgetam",
            needs=("torch", "transformers", "timm", "torchvision"),
            weights=Weights(usual="yonigozlan/EdgeTAM-hf", variable="R2C2R_EDGETAM_WEIGHTS"),
            licence="Apache-2.0 (EdgeTAM, code and weights)",
            summary="EdgeTAM: a small SAM 2 for machines without a GPU",
        ),
        Backend(
            name="sam3",
            target="r2c2r_core.segment.learned:Sam3Segmenter",
            extra="learned",
            needs=("torch", "transformers"),
            weights=Weights(usual="facebook/sam3", variable="R2C2R_SAM3_WEIGHTS", gated=True),
            licence="SAM License (gated weights; commercial use allowed, military use not)",
            licence_class="restricted",
            summary="SAM 3's tracker: the largest, for a GPU",
        ),
    ),
)

Fusion = Literal["none", "depth-mask", "evidence"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentConfig:
    """Lengths in metres, so that they hold for any camera."""

    cell_m: float = 0.0025  # mosaic cell: about a pixel of a phone at 2 m
    mosaic_frames: int = 24  # more add smear, not evidence (real kitchen: 24 and 48 cut alike)
    least_area_px: int = 60  # a smaller visible part does not count as seen
    weights: str = ""  # of a learned segmenter: a folder or a hub id; empty takes R2C2R_<NAME>_WEIGHTS, then its usual id
    fusion: Fusion = "evidence"  # of learned masks with depth: see fuse.py; "depth-mask" is the paper's

    def __post_init__(self) -> None:
        if self.fusion not in get_args(Fusion):
            raise InputError(f"segment.fusion is '{self.fusion}'", hint=f"choose one of: {', '.join(get_args(Fusion))}")


def open_session(
    capture: Capture,
    cache: Path,
    segmenter: str = SEGMENTERS.default,
    config: SegmentConfig | None = None,
    *,
    progress: Progress = SILENT,
) -> SegmentSession:
    """A capture made ready for clicks; heavy results live in `cache`."""
    config = config or SegmentConfig()
    backend = SEGMENTERS.load(segmenter, weights=config.weights)
    session: SegmentSession = backend.open(capture, cache, config, progress=progress)
    return session
