"""Detection of a depth unit other than the format's, by agreement of the frames."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.doctor.pairs import compare, far_pairs, neighbours, stack_views
from r2c2r_core.ingest.readers.protocol import RawFrame, Recording, UnreadableFrame
from r2c2r_core.model.capture import Capture, Depth
from r2c2r_core.tuning import param, tuned

UNITS = {  # factor to metres: description
    0.001: "millimetres read as metres",
    0.01: "centimetres read as metres",
    0.0125: "1/10000 m, rotated by three bits (as in APC), read as 1/1000 m",
    0.1: "1/10000 m read as 1/1000 m",
    0.125: "1/1000 m, rotated by three bits (as in SUN RGB-D), or 1/8000 m, read as 1/1000 m",
    0.2: "1/5000 m read as 1/1000 m",
    0.25: "1/4000 m read as 1/1000 m",
    5.0: "1/1000 m read as 1/5000 m",
    10.0: "centimetres read as millimetres",
    100.0: "centimetres read as 1/10000 m",
    1000.0: "metres read as millimetres",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of unit detection."""

    near_m: tuple[float, float] = param((0.4, 5.0), "m", "Range of plausible median depths of a recording")
    usual_m: float = param(1.5, "m", "Typical median depth in a room; the nearest unit is taken if frames do not decide", gt=0)
    clear: float = param(
        0.8, "ratio", "Ratio of the best unit's disagreement to the second best's below which the frames decide"
    )
    views: int = param(24, "count", "Maximum number of frames compared", ge=2)
    pairs: int = param(16, "count", "Maximum number of wide-baseline pairs", ge=1)


class Unit(NamedTuple):
    """A unit of the recorded depth, as a factor to metres."""

    factor: float
    text: str
    measured: bool  # by agreement of views, rather than by the typical depth in a room


def likely_unit(capture: Capture, recording: Recording, median_m: float, rng: np.random.Generator) -> Unit | None:
    """The unit with a plausible median depth and the best agreement of views; None where none fits."""
    params = tuned(Params)
    nearest, farthest = params.near_m
    fitting = [f for f in UNITS if nearest < f * median_m < farthest]
    if not fitting:
        return None
    costs = {factor: cost for factor in fitting if (cost := _disagreement(capture, recording, factor, rng)) is not None}
    ranked = sorted(costs, key=lambda factor: costs[factor])
    if ranked and (len(ranked) == 1 or costs[ranked[0]] < params.clear * costs[ranked[1]]):
        return Unit(ranked[0], UNITS[ranked[0]], measured=len(ranked) > 1)
    usual = min(fitting, key=lambda f: abs(np.log(f * median_m / params.usual_m)))
    return Unit(usual, UNITS[usual], measured=False)


def _disagreement(capture: Capture, recording: Recording, factor: float, rng: np.random.Generator) -> float | None:
    """Mean disagreement of views, in tolerances, with depth multiplied by `factor`; None without pairs."""
    raw = {frame.index: frame for frame in recording.frames}
    positions = [p for p, frame in enumerate(capture.frames) if frame.index in raw]
    positions = positions[:: -(-len(positions) // tuned(Params).views)] if positions else []
    try:
        views = stack_views(capture.frames, _Rescaled(recording, raw, factor), positions, rng) if positions else None
    except (UnreadableFrame, CaptureError):
        return None
    if views is None:
        return None
    pairs = (
        np.concatenate([neighbours(views), far_pairs(views, tuned(Params).pairs)])
        if len(positions) > 1
        else np.zeros((0, 2), np.int64)
    )
    return float(compare(views, pairs).cost.mean()) if len(pairs) else None


class _Rescaled:
    """Images of the recording with its depth multiplied by a factor."""

    def __init__(self, recording: Recording, raw: dict[int, RawFrame], factor: float) -> None:
        self._recording, self._raw, self._factor = recording, raw, factor

    def rgb(self, frame_index: int) -> Image:
        """Not available: raises KeyError."""
        raise KeyError(frame_index)

    def depth(self, frame_index: int) -> Depth:
        """Metres under the factor; 0 where nothing was recorded."""
        metres = np.nan_to_num(self._recording.depth_of(self._raw[frame_index]).metres, posinf=0.0, neginf=0.0) * self._factor
        return Depth(metres, metres > 0)
