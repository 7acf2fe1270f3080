"""Measures of the recording itself: frame rate, gaps, lost poses, damaged frames, depth before rejection."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.readers.protocol import Recording, UnreadableFrame
from r2c2r_core.model.capture import Frame

_FRAMES = 12  # sampled for the depth as recorded


class Timing(NamedTuple):
    """Frame timing, and fractions of missing and of unposed frames."""

    missing_share: float
    without_pose_share: float
    longest_gap_s: float | None
    fps: float | None
    duration_s: float | None


def measure_timing(recording: Recording | None, frames: Sequence[Frame]) -> Timing:
    """Frame rate and gaps, from the recording if given, as reading thins a long one."""
    every = recording.frames if recording else frames
    numbers = np.array([f.index for f in every])
    times = np.array([f.timestamp_s for f in every if f.timestamp_s is not None])
    expected = _expected_numbers(numbers)
    missing = np.setdiff1d(expected, numbers)
    unposed = _still_there(recording, missing) if recording else 0
    between = np.diff(times)
    duration = float(times[-1] - times[0]) if len(times) > 1 else None
    return Timing(
        missing_share=(len(missing) - unposed) / len(expected),
        without_pose_share=unposed / len(expected),
        longest_gap_s=float(between.max()) if len(between) else None,
        fps=(len(times) - 1) / duration if duration else None,
        duration_s=duration,
    )


def _expected_numbers(numbers: np.ndarray) -> np.ndarray:
    """Frame numbers of the recording without gaps; the given ones if they follow no step (such as times)."""
    gaps = np.diff(numbers)
    if not len(gaps):
        return numbers
    step = int(np.quantile(gaps, 0.25, method="lower"))
    if step < 1 or (gaps % step != 0).mean() > 0.1:
        return numbers
    return np.arange(numbers[0], numbers[-1] + 1, step)


def _still_there(recording: Recording, numbers: np.ndarray) -> int:
    """Number of these frames whose files exist although they were not read: those without a usable pose."""
    names, first = recording.files.names(), recording.frames[0]

    def numbered(name: str, number: int) -> str:
        return re.sub(r"\d+(?=\D*$)", lambda digits: f"{number:0{len(digits[0]) if digits[0][0] == '0' else 1}d}", name)

    return sum(all(numbered(name, n) in names for name in (first.rgb_name, first.depth_name)) for n in numbers.tolist())


def unreadable_share(recording: Recording, frames: int) -> float:
    """Fraction of the tried frames that ingest could not read; a long recording is thinned evenly first.

    Frames without a pose are tried only where the whole recording has none.
    """
    posed = sum(f.capture_from_camera is not None for f in recording.frames) or len(recording.frames)
    tried = -(-posed // max(1, round(posed / frames)))
    return max(0.0, 1.0 - frames / tried)


class Recorded(NamedTuple):
    """Recorded depth before rejection: median, and confidence fractions."""

    median_m: float | None
    confidence: tuple[float, float, float] | None


def measure_recorded(recording: Recording) -> Recorded:
    """Median of the recorded depth before rejection, and the fractions of low, medium and high confidence."""
    counts, medians = np.zeros(3), []
    for frame in recording.frames[:: max(1, len(recording.frames) // _FRAMES)]:
        try:
            metres, confidence, _ = recording.depth_of(frame)
        except (UnreadableFrame, CaptureError):
            continue
        known = metres[np.isfinite(metres) & (metres > 0)]
        if len(known):
            medians.append(float(np.median(known)))
        if confidence is not None:
            counts += np.bincount(np.clip(confidence.ravel(), 0, 2), minlength=3)
    low, medium, high = counts / max(counts.sum(), 1)
    shares = (float(low), float(medium), float(high)) if counts.any() else None
    return Recorded(float(np.median(medians)) if medians else None, shares)
