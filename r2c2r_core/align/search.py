"""Pose search: coarse scoring of all hypotheses, refinement of the best, and a final comparison of the contenders."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.align.hypotheses import Hypothesis
from r2c2r_core.align.judge import Judgement, judge
from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import Observation
from r2c2r_core.align.refine import refine, turned_about_middle
from r2c2r_core.align.residuals import anchors_for
from r2c2r_core.align.shape import Shape, spins_alike
from r2c2r_core.align.sweep import sweep_loosest
from r2c2r_core.align.view import View
from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Similarity3, rotation_between
from r2c2r_core.kitchen.names import named
from r2c2r_core.model.track import FrontPanel, MaskTrack
from r2c2r_core.progress import Progress
from r2c2r_core.tuning import param, tuned

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned thresholds between different poses."""

    turned_deg: float = param(20.0, "deg", "Minimum rotation between two poses that count as different")
    resized: float = param(
        0.04,
        "log",
        "Minimum log ratio between two scales that count as different",
        source="twice the tolerance of a placement",
    )
    upright_deg: float = param(3.0, "deg", "Maximum tilt of an upright pose", source="bases of generated meshes are bumpy")
    scatter: float = param(0.01, "score", "Random variation of the scores of one pose under sub-pixel shifts")
    toppled_deg: float = param(30.0, "deg", "Tilt above which a pose is not a slightly tilted standing pose")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """Data that a pose must explain."""

    shape: Shape
    observation: Observation
    track: MaskTrack
    lifted: list[Lifted]

    @property
    def front(self) -> FrontPanel | None:
        """The measured panel, if the object is a front."""
        return self.track.front if self.track.kind == "front" else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """A hypothesis with its score."""

    hypothesis: Hypothesis
    judgement: Judgement

    @property
    def pose(self) -> Similarity3:
        """world_from_mesh."""
        return self.hypothesis.pose


def try_poses(
    proposals: list[Hypothesis], case: Case, scale_range: tuple[float, float], refined: int, progress: Progress
) -> list[Trial]:
    """Trials of the best distinct proposals, refined and ordered by score; all proposals are first scored in some views."""
    views = case.observation.views
    few = views[::2] if len(views) > 5 else views
    rough = []
    for k, proposal in enumerate(proposals):
        progress.at(0.5 * k / max(len(proposals), 1), f"{case.track.name}: pose {k + 1}/{len(proposals)}")
        if scale_range[0] <= proposal.pose.scale <= scale_range[1]:
            rough.append(_judged(proposal, case, few))
    rough.sort(key=lambda t: -t.judgement.score)
    trials = []
    for k, trial in enumerate(_different(rough)[:refined]):
        progress.at(0.5 + 0.5 * k / refined, f"{case.track.name}: refining pose {k + 1}")
        hypothesis = _refined(trial.hypothesis, case)
        if scale_range[0] <= hypothesis.pose.scale <= scale_range[1]:
            trials.append(_judged(hypothesis, case, views))
    return sorted(trials, key=lambda t: -t.judgement.score)


def finish_contenders(trials: list[Trial], case: Case) -> list[Trial]:
    """The best trial and its possible rivals (`trials` are ordered by score), equally refined, the winner first.

    An object that would topple at its pose wins only where it fits better than one that stands.
    """
    params = tuned(Params)
    finished = [_finish(t, case) for t in _contenders(trials, case)]
    return sorted(finished, key=lambda t: (lean_deg(t.pose, case) > 0) * params.scatter - t.judgement.score)


def finish_known(hypothesis: Hypothesis, case: Case) -> Trial:
    """A known pose with its score. Fronts and appliances were measured over all frames; a thing's pose is refined."""
    known = _judged(hypothesis, case, case.observation.views)
    return _finish(known, case) if case.track.kind == "thing" else known


def turned_otherwise(trial: Trial, best: Trial, shape: Shape) -> bool:
    """Whether it has a different orientation; rotations about an axis of revolution do not count."""
    if angle_deg(best.pose, trial.pose) < tuned(Params).turned_deg:
        return False
    turn = trial.pose.rotation.T @ best.pose.rotation
    return not spins_alike(shape, Rotation.from_matrix(turn).as_rotvec())


def resized(trial: Trial, best: Trial) -> bool:
    """Whether it has the same orientation, but another scale."""
    params = tuned(Params)
    alike = angle_deg(best.pose, trial.pose) < params.turned_deg
    return alike and abs(float(np.log(trial.pose.scale / best.pose.scale))) > params.resized


def lean_deg(pose: Similarity3, case: Case) -> float:
    """Tilt from the nearest stable standing pose, degrees; 0 where it stands, and where no such pose is known."""
    if case.track.kind != "thing" or not case.shape.bases:
        return 0.0
    lean = _angle_to_base(pose, _nearest_base(pose, case.shape))
    return lean if lean > tuned(Params).upright_deg else 0.0


def angle_deg(a: Similarity3, b: Similarity3) -> float:
    """Angle between the rotations of two poses."""
    cosine = (np.trace(a.rotation.T @ b.rotation) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _contenders(trials: list[Trial], case: Case) -> list[Trial]:
    """The best trial, the best of another orientation and of another size, and upright versions of those slightly tilted."""
    params = tuned(Params)
    best = trials[0]
    different: tuple[Callable[[Trial], bool], ...] = (
        lambda t: turned_otherwise(t, best, case.shape),
        lambda t: resized(t, best),
    )
    rivals = [next(filter(differs, trials[1:]), None) for differs in different]
    found = [best, *(t for t in rivals if t is not None)]
    return found + [_stood_upright(t, case) for t in found if 0 < lean_deg(t.pose, case) < params.toppled_deg]


def _stood_upright(trial: Trial, case: Case) -> Trial:
    """The trial rotated by the smallest angle onto the nearest side it can stand on."""
    base = _nearest_base(trial.pose, case.shape)
    turn = rotation_between(trial.pose.rotation @ base, _UP)
    upright = Hypothesis(turned_about_middle(trial.pose, turn, case.shape), base, trial.hypothesis.source)
    return _judged(_refined(upright, case), case, case.observation.views)


def _finish(trial: Trial, case: Case) -> Trial:
    """Refinement of a trial: joint fit with free scale, closest points with fixed scale, then a photometric sweep."""
    evidence = (case.shape, case.observation, anchors_for(case.track, case.shape, trial.hypothesis.up_mesh), case.lifted)
    pose = refine(trial.pose, *evidence, free_scale=True, iterations=10, loose=0.02)
    pose = refine(pose, *evidence, free_scale=False, iterations=4, loose=0.012)
    pose = _level_on_legs(sweep_loosest(pose, *evidence), case)
    finished = _judged(trial.hypothesis._replace(pose=pose), case, case.observation.views)
    return trial if finished.judgement.score < trial.judgement.score - tuned(Params).scatter else finished


def _level_on_legs(pose: Similarity3, case: Case) -> Similarity3:
    """Pose of a table or chair with all its feet on one level, where it leans by less than the scan's level may be off."""
    if not named(case.track.category)[0].on_legs or not case.shape.bases:
        return pose
    base = _nearest_base(pose, case.shape)
    if _angle_to_base(pose, base) > tuned(Params).upright_deg:
        return pose
    return turned_about_middle(pose, rotation_between(pose.rotation @ base, _UP), case.shape)


def _refined(hypothesis: Hypothesis, case: Case) -> Hypothesis:
    anchors = anchors_for(case.track, case.shape, hypothesis.up_mesh)
    pose = refine(
        hypothesis.pose, case.shape, case.observation, anchors, case.lifted, free_scale=True, iterations=8, loose=0.06
    )
    return hypothesis._replace(pose=pose)


def _judged(hypothesis: Hypothesis, case: Case, views: tuple[View, ...]) -> Trial:
    return Trial(hypothesis=hypothesis, judgement=judge(hypothesis.pose, case.shape, views, case.front))


def _different(trials: list[Trial]) -> list[Trial]:
    """The best of each group of poses that agree in rotation and scale."""
    kept: list[Trial] = []
    for trial in trials:
        if all(angle_deg(trial.pose, k.pose) > 10.0 or abs(np.log(trial.pose.scale / k.pose.scale)) > 0.1 for k in kept):
            kept.append(trial)
    return kept


def _nearest_base(pose: Similarity3, shape: Shape) -> Vector3:
    return min(shape.bases, key=lambda base: _angle_to_base(pose, base))


def _angle_to_base(pose: Similarity3, base: Vector3) -> float:
    """Degrees between a base's up and the vertical."""
    return float(np.degrees(np.arccos(np.clip((pose.rotation @ base)[2], -1.0, 1.0))))
