"""Whether a placement can be trusted: rivals that fit as well, motions that nothing holds, and both in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from r2c2r_core.align.judge import Judgement
from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import Observation
from r2c2r_core.align.refine import rim_unit
from r2c2r_core.align.residuals import Anchors, Rows, all_rows, finest_gate
from r2c2r_core.align.shape import Shape, spins_alike
from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.least_squares import Normal
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.model.placement import Spread
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """When a placement is called uncertain."""

    loose_deg: float = param(
        1.5, "deg", "of turn, from which on a placement is not held", source="what is asked of a placement"
    )
    loose_m: float = param(0.015, "m", "of shift, from which on a placement is not held", source="what is asked of a placement")
    loose_scale: float = param(0.02, "share", "of scale, from which on it is not held", source="what is asked of a placement")
    confidence: float = param(
        0.975, "share", "of readings that lie below: Student's t at it widens", source="two σ, one side", lt=1
    )
    sigmas: float = param(2.0, "σ", "at which a motion is stated")
    alike: float = param(0.003, "score", "between two poses that cannot be told apart")
    clear: float = param(0.05, "score", "between two poses of which one is clearly better")
    full_frames: int = param(9, "count", "frames as whose independent readings the weights of points and outlines count", gt=0)
    known_frames: int = param(3, "count", "frames' worth of what other objects tell of how much frames differ", gt=0)


def spread_of(pose: Similarity3, shape: Shape, observation: Observation, anchors: Anchors, lifted: Sequence[Lifted]) -> Spread:
    """Standard deviations of turn, shift and scale that all the evidence together leaves.

    Turns that leave the shape as it is (a bottle's yaw) count for nothing.
    """
    unit = rim_unit(observation.size_m)
    covariance = _covariance(all_rows(pose, shape, observation, anchors, lifted, finest_gate(observation)), unit)
    covariance *= np.outer(unit, unit)
    turn_deg, turn_axis = 0.0, np.array([0.0, 0.0, 1.0])
    values, vectors = np.linalg.eigh(covariance[:3, :3])
    for value, axis in zip(values[::-1], vectors.T[::-1], strict=True):
        if not spins_alike(shape, pose.rotation.T @ axis):
            turn_deg, turn_axis = float(np.degrees(np.sqrt(value))), axis
            break
    values, vectors = np.linalg.eigh(covariance[3:6, 3:6])
    return Spread(
        turn_deg=turn_deg,
        turn_axis_world=turn_axis,
        shift_m=float(np.sqrt(values[-1])),
        shift_axis_world=vectors[:, -1],
        scale=float(np.sqrt(covariance[6, 6])),
    )


def _covariance(rows: list[Rows], unit: np.ndarray) -> np.ndarray:
    """Covariance (7, 7) of the step in `unit`: what single readings' noise leaves, and what frames disagree by.

    A mask's outline and a depth frame are wrong over whole stretches, so their pixels are no independent readings. What
    that makes of the pose is seen by leaving out one frame at a time (the jackknife, one Newton step for each), and is
    widened by Student's t: two frames that agree by chance say little. What all frames are wrong by alike is not seen so;
    the fewer they are, the more of it there is. The normal matrix is inverted as a whole: a turn that a shift makes up for
    counts as free.
    """
    params = tuned(Params)
    joined = Rows(*(np.concatenate(column) for column in zip(*rows, strict=True)))
    jacobian = joined.jacobian * unit
    normal = Normal.of(jacobian, joined.residual, joined.weight) + Normal(1e-3 * np.eye(7), np.zeros(7))
    steps = []
    for frame in np.unique(joined.frame_index[joined.frame_index >= 0]):
        own = joined.frame_index == frame
        steps.append((normal - Normal.of(jacobian[own], joined.residual[own], joined.weight[own])).step())
    noise = np.linalg.inv(normal.information) * max(1.0, params.full_frames / max(len(steps), 1))
    if len(steps) < 2:
        return noise
    apart = np.array(steps) - np.mean(steps, axis=0)
    widened = float(stdtrit(len(steps) - 1 + params.known_frames, params.confidence) / ndtri(params.confidence))
    return np.asarray(noise + widened**2 * (len(steps) - 1) / len(steps) * apart.T @ apart)


def ties(best: Judgement, rival: Judgement) -> bool:
    """Whether the two cannot be told apart: the scores are close, or close and not consistently ordered over views."""
    gain = np.array([a.total - b.total for a, b in zip(best.views, rival.views, strict=True)])
    mean = best.score - rival.score
    params = tuned(Params)
    if not params.alike < mean < params.clear:
        return mean <= params.alike
    spread = float(gain.std(ddof=1)) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
    return bool(mean < params.sigmas * spread)


def loose_ends(spread: Spread, front: FrontPanel | None) -> tuple[str, ...]:
    """What the scan does not hold as well as a placement should be, a line each; a front tells where the wall is."""
    params = tuned(Params)
    limits = np.array([params.loose_deg, params.loose_m, params.loose_scale])
    figures = np.array([spread.turn_deg, spread.shift_m, spread.scale])
    texts = (
        (_turn_in_words(spread.turn_axis_world), f"{params.sigmas * spread.turn_deg:.1f} degrees"),
        (_shift_in_words(spread.shift_axis_world, front), f"{1000 * params.sigmas * spread.shift_m:.0f} mm"),
        ("its size", f"{100 * params.sigmas * spread.scale:.0f} %"),
    )
    return tuple(
        f"{what} is hardly held by what the scan shows: it may be off by {how_much}"
        for (what, how_much), loose in zip(texts, params.sigmas * figures > limits, strict=True)
        if loose
    )


def _turn_in_words(axis_world: Vector3) -> str:
    return "its turn about the vertical" if abs(axis_world[2]) > 0.8 else "its lean"


def _shift_in_words(axis_world: Vector3, front: FrontPanel | None) -> str:
    if abs(axis_world[2]) > 0.8:
        return "its height above the floor"
    if front is None:
        return "its place on the floor"
    along, into, _ = np.abs(axis_world @ front.world_from_front.rotation)
    return "its place along the wall" if along > into else "its distance from the wall"
