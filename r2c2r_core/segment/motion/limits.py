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
    least_frames: int = param(3, "count", "Minimum number of frames that show the largest opening", ge=2)
    n_sigma: float = param(
        4.0, "σ", "Range of error of a state at rest: a leaf seen edge-on may seem to rest where its angle is least known", ge=0
    )
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


def stop_seen(values: np.ndarray, sigmas: np.ndarray, frames: Sequence[int], largest: float, *, turns: bool) -> bool:
    """Whether the leaf moved to its largest state on camera and rested there for longer than it takes to turn back.

    `values` and their standard deviations are those of the frames with these numbers. A leaf that turns back at once, at any
    speed, spends twice as long within four times a distance of its end.
    """
    params, still = tuned(Params), _still(turns=turns)
    for start, stop in _stretches(np.abs(values - largest) < still):
        before = values[:start]  # a leaf open from the first frame on, or one that closes from here, need not have met a stop
        arrived = start > 0 and 2 * still < before[-1] and before.min() < largest - params.arrives * still
        if stop - start < params.least_frames or not arrived:
            continue
        error = max(still, params.n_sigma * float(np.median(sigmas[start:stop])))
        near = _time_below(np.abs(values - largest), frames, error, start)
        wider = _time_below(largest - values, frames, 4 * error, start)
        turning = wider - near  # time within `error` of the end if it had turned back at once
        if near > 2 * turning:
            return True
    return False


def _time_below(values: np.ndarray, frames: Sequence[int], limit: float, within: int) -> float:
    """Time (frames) for which interpolated values stay below a limit around one of them."""
    start, stop = next(each for each in _stretches(values < limit) if each[0] <= within < each[1])

    def crossing(outside: int, inside: int) -> float:
        if not 0 <= outside < len(values):
            return float(frames[inside])
        share = (limit - values[inside]) / (values[outside] - values[inside])
        return float(frames[inside] + share * (frames[outside] - frames[inside]))

    return crossing(stop, stop - 1) - crossing(start - 1, start)


def _still(*, turns: bool) -> float:
    params = tuned(Params)
    return params.still_rad if turns else params.still_m


def _stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    """First index, and one past the last, of each stretch of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
