"""Reasons not to process a recording."""

from pathlib import Path
from typing import NamedTuple

from r2c2r_core.ingest.doctor.examine import examine
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.model.capture import Capture
from r2c2r_core.progress import SILENT, Progress

_NOTHING_COMES_OF = ("depth_unit", "confidence", "depth_coverage")  # no surface is left to build from


class Doubts(NamedTuple):
    """Reasons why a recording is unusable, worst first; empty if it is usable."""

    reasons: tuple[str, ...]  # one line each, with a remedy
    hopeless: bool  # no result is possible


def find_doubts(source: Path, capture: Capture, *, progress: Progress = SILENT) -> Doubts:
    """The doctor's remarks that make the recording unusable."""
    progress.at(0.0, "examining the recording")
    unusable = [r for r in examine(capture, open_recording(source)).remarks if r.verdict == "unusable"]
    return Doubts(tuple(r.line for r in unusable), any(r.cause in _NOTHING_COMES_OF for r in unusable))
