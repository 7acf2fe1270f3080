"""Largest observed opening of a leaf. A pause there is no stop: people hold doors still."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the largest opening."""

    still_rad: float = param(float(np.deg2rad(2.0)), "rad", "Maximum change of angle of a door at rest: a frame's error")
    still_m: float = param(0.006, "m", "Maximum displacement of a drawer at rest: a frame's error")
    least_frames: int = param(3, "count", "Minimum number of frames that show the largest opening", ge=2)


def widest(fitted: np.ndarray, values: np.ndarray, *, turns: bool) -> float:
    """Largest state, among fitted states and those sustained for some frames; a single frame's error does not count."""
    still, count = _still(turns=turns), tuned(Params).least_frames
    top = float(np.quantile(fitted, 1 - min(2 / len(fitted), 0.05)))
    if len(values) >= count:
        top = max(top, float(np.lib.stride_tricks.sliding_window_view(values, count).min(axis=1).max()))
    every = np.concatenate([fitted, values])
    return float(np.median(every[np.abs(every - top) < still]))


def _still(*, turns: bool) -> float:
    params = tuned(Params)
    return params.still_rad if turns else params.still_m
