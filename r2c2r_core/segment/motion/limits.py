"""Joint limit from the observed motion: the largest opening, and whether it was a stop, where the motion ended at rest."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the detection of a stop."""

    still_rad: float = param(float(np.deg2rad(2.0)), "rad", "Maximum change of angle of a door at rest: a frame's error")
    still_m: float = param(0.006, "m", "Maximum displacement of a drawer at rest: a frame's error")
    dwell_s: float = param(
        0.4, "s", "Minimum time at rest at the largest opening", source="a leaf that turns back at once has not stopped"
    )
    fps: float = param(15.0, "count", "Frames per second of a recording without timestamps", gt=0)
    least_frames: int = param(3, "count", "Minimum number of frames that show the largest opening", ge=2)
    arrives: float = param(
        4.0, "ratio", "Minimum opening motion observed before a stop, relative to the tolerance of rest", ge=2
    )


def widest(fitted: np.ndarray, values: np.ndarray, *, turns: bool) -> float:
    """Largest state, among fitted states and those sustained for some frames; a single frame's error does not count."""
    still, count = _still(turns=turns), tuned(Params).least_frames
    top = float(np.quantile(fitted, 1 - min(2 / len(fitted), 0.05)))
    if len(values) >= count:
        top = max(top, float(np.lib.stride_tricks.sliding_window_view(values, count).min(axis=1).max()))
    every = np.concatenate([fitted, values])
    return float(np.median(every[np.abs(every - top) < still]))


def stop_seen(values: np.ndarray, seconds: Sequence[float | None], largest: float, *, turns: bool) -> bool:
    """Whether the leaf moved to its largest state on camera and rested there."""
    params, still = tuned(Params), _still(turns=turns)
    held = np.abs(values - largest) < still
    times = np.array([k / params.fps if t is None else t for k, t in enumerate(seconds)])
    for start, stop in _stretches(held):
        long = stop - start >= params.least_frames and times[stop - 1] - times[start] >= params.dwell_s
        before = values[:start]  # a leaf open from the first frame on, or one that closes from here, need not have met a stop
        arrived = start > 0 and 2 * still < before[-1] and before.min() < largest - params.arrives * still
        if long and arrived:
            return True
    return False


def _still(*, turns: bool) -> float:
    params = tuned(Params)
    return params.still_rad if turns else params.still_m


def _stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    """First index, and one past the last, of each stretch of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
