"""How far a leaf was seen to open, and whether that was its stop: held still where its motion ended."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What counts as a stop."""

    still_rad: float = param(float(np.deg2rad(2.0)), "rad", "within which a door stands still: a frame's error")
    still_m: float = param(0.006, "m", "within which a drawer stands still: a frame's error")
    dwell_s: float = param(
        0.4, "s", "that it must have stood still at its widest", source="what turns back at once has not stopped"
    )
    fps: float = param(15.0, "count", "frames of a second, where a recording has no times", gt=0)
    least_frames: int = param(3, "count", "that show it at its widest", ge=2)


def widest(values: np.ndarray, *, turns: bool) -> float:
    """The widest state: the median of those that cannot be told from the largest; one frame's error does not count."""
    still = _still(turns=turns)
    top = float(np.quantile(values, 1 - min(2 / len(values), 0.05)))
    return float(np.median(values[values > top - still]))


def stop_seen(values: np.ndarray, seconds: Sequence[float | None], *, turns: bool) -> bool:
    """Whether it was moved to its widest state before the camera and stood still there."""
    params, still = tuned(Params), _still(turns=turns)
    largest = widest(values, turns=turns)
    held = np.abs(values - largest) < still
    times = np.array([k / params.fps if t is None else t for k, t in enumerate(seconds)])
    for start, stop in _stretches(held):
        long = stop - start >= params.least_frames and times[stop - 1] - times[start] >= params.dwell_s
        beside = [k for k in (start - 1, stop) if 0 <= k < len(values)]
        moving = any(2 * still < values[k] < largest - still for k in beside)
        if long and moving:
            return True
    return False


def _still(*, turns: bool) -> float:
    params = tuned(Params)
    return params.still_rad if turns else params.still_m


def _stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    """First, and one past the last, of each stretch of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
