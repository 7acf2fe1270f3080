"""Uncertainty of a placement: covariance of the pose, competing modes, ill-conditioned motions, and both in words."""

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
    """Tuned thresholds of uncertain placements."""

    loose_deg: float = param(
        1.5,
        "deg",
        "Uncertainty of the rotation above which a placement counts as unconstrained",
        source="accuracy required of a placement",
    )
    loose_m: float = param(
        0.015,
        "m",
        "Uncertainty of the translation above which a placement counts as unconstrained",
        source="accuracy required of a placement",
    )
    loose_scale: float = param(
        0.02,
        "share",
        "Uncertainty of the scale above which a placement counts as unconstrained",
        source="accuracy required of a placement",
    )
    confidence: float = param(
        0.975,
        "share",
        "One-sided quantile at which Student's t widens the jackknife covariance",
        source="two σ, one side",
        lt=1,
    )
    sigmas: float = param(2.0, "σ", "Number of standard deviations at which an uncertain motion is reported")
    alike: float = param(0.003, "score", "Score difference below which two poses are indistinguishable")
    clear: float = param(0.05, "score", "Score difference above which one pose is clearly better")
    full_frames: int = param(9, "count", "Number of independent frames that the weights of points and outlines assume", gt=0)
    known_frames: int = param(
        3, "count", "Additional degrees of freedom, in frames, from other objects' spread between frames", gt=0
    )


def spread_of(pose: Similarity3, shape: Shape, observation: Observation, anchors: Anchors, lifted: Sequence[Lifted]) -> Spread:
    """Standard deviations of rotation, translation and scale from all the evidence.

    Rotations under which the shape is invariant (a bottle's yaw) are ignored.
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
    """Covariance (7, 7) of the step in `unit`: measurement noise plus jackknife spread between frames.

    Errors of a mask's outline and of a depth frame are correlated over whole stretches, so their pixels are not independent.
    Their effect on the pose is estimated by leaving out one frame at a time (the jackknife, one Newton step each), widened by
    Student's t: two frames that agree by chance carry little information. Errors common to all frames are not captured; the
    fewer the frames, the larger these are. The normal matrix is inverted as a whole: a rotation that a translation can
    compensate counts as unconstrained.
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
    """Whether the two are indistinguishable: their scores are close, or moderately close and inconsistent over views."""
    gain = np.array([a.total - b.total for a, b in zip(best.views, rival.views, strict=True)])
    mean = best.score - rival.score
    params = tuned(Params)
    if not params.alike < mean < params.clear:
        return mean <= params.alike
    spread = float(gain.std(ddof=1)) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
    return bool(mean < params.sigmas * spread)


def loose_ends(spread: Spread, front: FrontPanel | None) -> tuple[str, ...]:
    """Motions that the scan constrains less than a placement requires, a line each; a front gives the wall's direction."""
    params = tuned(Params)
    limits = np.array([params.loose_deg, params.loose_m, params.loose_scale])
    figures = np.array([spread.turn_deg, spread.shift_m, spread.scale])
    texts = (
        (_turn_in_words(spread.turn_axis_world), f"{params.sigmas * spread.turn_deg:.1f}°"),
        (_shift_in_words(spread.shift_axis_world, front), f"{1000 * params.sigmas * spread.shift_m:.0f} mm"),
        ("its size", f"{100 * params.sigmas * spread.scale:.0f} %"),
    )
    return tuple(
        f"{what} is poorly constrained by the scan: it may be off by {how_much}"
        for (what, how_much), loose in zip(texts, params.sigmas * figures > limits, strict=True)
        if loose
    )


def _turn_in_words(axis_world: Vector3) -> str:
    return "its yaw" if abs(axis_world[2]) > 0.8 else "its tilt"


def _shift_in_words(axis_world: Vector3, front: FrontPanel | None) -> str:
    if abs(axis_world[2]) > 0.8:
        return "its height above the floor"
    if front is None:
        return "its place on the floor"
    along, into, _ = np.abs(axis_world @ front.world_from_front.rotation)
    return "its place along the wall" if along > into else "its distance from the wall"
