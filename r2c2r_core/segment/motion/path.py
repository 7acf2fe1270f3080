"""Most probable sequence of a leaf's states over the frames: dynamic programming with a motion prior (Viterbi 1967)."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the motion prior."""

    step_cost: float = param(0.3, "log", "Cost of each step that a state changes between two frames")
    jump_cost: float = param(12.0, "log", "Maximum cost of a change: a recording may pause, and a leaf may be moved unseen")


def best_path(log: np.ndarray) -> tuple[np.ndarray, float]:
    """Viterbi path: state indices (frames,) of the most probable sequence by log-likelihoods (frames, states), and its sum."""
    params = tuned(Params)
    count = log.shape[1]
    apart = np.abs(np.arange(count)[:, None] - np.arange(count)[None])
    cost = np.minimum(params.step_cost * apart, params.jump_cost)
    total, back = log[0].copy(), np.zeros(log.shape, np.int64)
    for frame in range(1, len(log)):
        reach = total[None, :] - cost
        back[frame] = reach.argmax(axis=1)
        total = log[frame] + reach.max(axis=1)
    states = np.zeros(len(log), np.int64)
    states[-1] = int(total.argmax())
    for frame in range(len(log) - 1, 0, -1):
        states[frame - 1] = back[frame, states[frame]]
    return states, float(total.max())
