"""Capture + prompts -> mask tracks (paper 4.1)."""

from dataclasses import dataclass
from pathlib import Path

from r2c2r_core.model.capture import Capture
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.registry import Backend, Registry
from r2c2r_core.segment.protocol import SegmentSession

SEGMENTERS = Registry(
    "segmenter",
    (
        Backend(
            name="geometric",
            target="r2c2r_core.segment.geometric:GeometricSegmenter",
            summary="weight-free: fronts cut on an ortho mosaic, things cut from the fused surface",
        ),
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentConfig:
    """Lengths in metres, so that they hold for any camera."""

    cell_m: float = 0.0025  # mosaic cell: about a pixel of a phone at 2 m
    mosaic_frames: int = 24  # more add smear, not evidence (real kitchen: 24 and 48 cut alike)
    least_area_px: int = 60  # a smaller visible part does not count as seen


def open_session(
    capture: Capture,
    cache: Path,
    segmenter: str = SEGMENTERS.default,
    config: SegmentConfig | None = None,
    *,
    progress: Progress = SILENT,
) -> SegmentSession:
    """A capture made ready for clicks; heavy results live in `cache`."""
    backend = SEGMENTERS.load(segmenter)
    session: SegmentSession = backend.open(capture, cache, config or SegmentConfig(), progress=progress)
    return session
