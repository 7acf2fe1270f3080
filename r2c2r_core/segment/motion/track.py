"""READ FIRST: a leaf's motion over all frames: the joint by model comparison, then joint and states by one robust fit.

For each joint that a leaf may have, dynamic programming finds the most probable sequence of states. The joint whose sequence
explains the depth best is chosen, if it explains it better than a leaf that never moved. The leaf's category acts as a prior
that a few frames overrule.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from r2c2r_core.model.capture import Frame
from r2c2r_core.model.motion import JointMotion, State
from r2c2r_core.segment.motion.bundle import FittedJoint, as_supposed, fit_joint
from r2c2r_core.segment.motion.hypotheses import Hypothesis, Way, hypotheses
from r2c2r_core.segment.motion.lateral import slid
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.motion.likelihood import States, closed_counts, evidence, in_view, lay_out, static_evidence
from r2c2r_core.segment.motion.limits import widest
from r2c2r_core.segment.motion.path import best_path
from r2c2r_core.segment.motion.pose import fix_plane
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of motion detection."""

    vacated_share: float = param(
        0.5, "share", "Fraction of readings agreeing with the closed leaf below which a frame may show it open"
    )
    closed_share: float = param(0.7, "share", "Minimum fraction of readings agreeing with the closed leaf for it to be closed")
    least_known: int = param(20, "count", "Minimum number of readings towards the closed leaf in a frame", ge=1)
    least_closed: int = param(
        5, "count", "Minimum number of readings that show whether the closed place is filled, where few are in view", ge=1
    )
    silent_cost: float = param(2.0, "log", "Cost of every open state where black glass lacks depth, as it does when closed")
    least_frames: int = param(
        3, "count", "Minimum number of frames that must show the closed place vacated, and the leaf elsewhere", ge=1
    )
    free_share: float = param(
        0.5, "share", "Minimum fraction of readings towards the open leaf's place that look past it while the leaf is closed"
    )
    closed_cost: float = param(60.0, "log", "Cost of every open state in a frame that shows the leaf closed")
    static_frames: int = param(8, "count", "Number of frames with the leaf closed that show what stands around it", ge=1)
    gain: float = param(40.0, "log", "Minimum log-likelihood gain of a sequence over a leaf that never moved")
    support: float = param(40.0, "log", "Minimum log-likelihood of the readings on the open leaf: occluders contribute none")
    told: float = param(3.0, "log", "Minimum evidence for a frame's state for the leaf to be localised in it")
    closed_rad: float = param(float(np.deg2rad(2.0)), "rad", "Minimum angle of an open door: a frame's error")
    closed_m: float = param(0.01, "m", "Minimum displacement of an open sliding leaf: a frame's error, and a handle's relief")
    moves_steps: float = param(4.0, "count", "Minimum range, in steps of states, of the motion of a leaf never seen closed")
    sure: float = param(20.0, "log", "Evidence of a frame below which the neighbouring fits extend its search range")
    around_steps: float = param(2.0, "count", "Margin of the search range, in steps of states, in a frame without a fit")
    finer: float = param(6.0, "ratio", "Ratio of those steps to the finer ones searched: a board is thicker than these", gt=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """A hypothesis, and the most probable state of the leaf in each frame."""

    hypothesis: Hypothesis
    values: np.ndarray  # (frames,) radians or metres
    log: np.ndarray  # (frames,) evidence for each
    gain: float  # over a leaf that never moved, with the prior
    support: float  # evidence of the frames in which it stands open


Seen = dict[int, tuple[float, float]]
"""State and standard deviation by the frame's position in the recording."""

NO_PRIOR: Mapping[Way, float] = MappingProxyType({})


def find_motion(
    leaf: Leaf, scene: Scene, prior: Mapping[Way, float] = NO_PRIOR, part: str = "", *, only: bool = False
) -> tuple[Leaf, JointMotion | None]:
    """Leaf as thick as its motion shows, and the joint on which it moved; None where it was never seen off its closed place.

    `prior` gives the log prior odds of each way of opening over the others. With `only`, motion in a way that `prior` does not
    name is rejected: half a front is a leaf only where it opens as one of a pair.
    """
    params = tuned(Params)
    counts = closed_counts(leaf, scene.frames, scene)
    known = counts[:, :3].sum(axis=1)
    agrees = counts[:, 0] / np.maximum(known, 1)
    vacated = (agrees < params.vacated_share) & (known >= params.least_known)
    if vacated.sum() < params.least_frames:
        return leaf, None
    closed = (agrees > params.closed_share) & (known >= params.least_closed)
    silent = (counts[:, 3] > params.closed_share * counts.sum(axis=1)) & (counts.sum(axis=1) >= params.least_known)
    silent &= closed.sum() < params.least_frames  # black glass, which never shows its closed face
    through = counts[:, 1] >= params.least_closed
    tried = [each for each in hypotheses(leaf, scene.floor_m) if not each.lateral or closed.sum() >= params.least_frames]
    if through.sum() < params.least_frames:  # hidden and never seen into: hidden by the leaf itself, drawn out, or by others
        tried = [each for each in tried if each.way == "out"]
    before = _nearest(scene.frames, closed, vacated)
    courses = [_course(lay_out(leaf, each), scene, closed, silent, before, prior.get(each.way, 0.0)) for each in tried]
    for course in sorted(courses, key=lambda course: -course.gain):
        if course.gain < params.gain:
            break
        # Its place is seen into while the leaf is seen elsewhere; a place that is only hidden shows an occluder, no motion.
        empty = (through & (course.values > 0) & (course.log > params.told)).sum() >= params.least_frames
        if course.hypothesis.way == "out":  # a drawer hides its own place: the space where it stands was seen through before
            empty |= _was_free(leaf, course, scene, closed)
        found = _measured(leaf, course, scene, silent, part) if empty and course.support > params.support else None
        if found is not None:
            return (leaf, None) if only and course.hypothesis.way not in prior else found
    return leaf, None


def _nearest(frames: Sequence[Frame], closed: np.ndarray, vacated: np.ndarray) -> list[Frame]:
    """Frames with the leaf closed that are nearest in time to those that show its place vacated."""
    known = np.flatnonzero(closed)
    away = np.abs(known[:, None] - np.flatnonzero(vacated)).min(axis=1)
    return [frames[k] for k in known[np.argsort(away, kind="stable")[: tuned(Params).static_frames]]]


def _course(
    states: States, scene: Scene, closed: np.ndarray, silent: np.ndarray, before: Sequence[Frame], prior: float
) -> Course:
    """Most probable sequence of states under a hypothesis; what `before`, frames with the leaf closed, show is not the leaf."""
    params, values = tuned(Params), states.hypothesis.states
    shut = np.where(np.arange(len(values)) > 0, -params.closed_cost, 0.0)
    log = np.stack([shut if is_shut else evidence(states, scene, f) for is_shut, f in zip(closed, scene.frames, strict=True)])
    if not states.hypothesis.lateral:
        log[~closed] -= static_evidence(states, scene, before)
    log[silent, 1:] -= params.silent_cost
    path, total = best_path(log)
    own = log[np.arange(len(path)), path]
    gain = total - float(log[:, 0].sum()) + prior
    return Course(hypothesis=states.hypothesis, values=values[path], log=own, gain=gain, support=float(own[path > 0].sum()))


def _was_free(leaf: Leaf, course: Course, scene: Scene, closed: np.ndarray) -> bool:
    """Whether most frames that show a leaf closed look past where it stands open."""
    params = tuned(Params)
    frames = [frame for frame, is_closed in zip(scene.frames, closed, strict=True) if is_closed]
    opened = course.values[course.values > 0]
    if len(frames) < params.least_frames or len(opened) == 0:
        return False
    counts = closed_counts(leaf.at(course.hypothesis.pose(float(np.median(opened)))), frames, scene)
    return bool((counts[:, 1] > params.free_share * counts[:, :3].sum(axis=1)).sum() > len(frames) / 2)


def _measured(leaf: Leaf, course: Course, scene: Scene, silent: np.ndarray, part: str) -> tuple[Leaf, JointMotion] | None:
    """Leaf and joint fitted to the frames that show the leaf; None where too few of them show it in one piece."""
    params, step = tuned(Params), float(course.hypothesis.states[1])
    joint, seen = _fitted(leaf, course, scene)
    seen |= {int(k): (0.0, params.closed_rad) for k in np.flatnonzero(silent & (course.values == 0)) if k not in seen}
    opened = [value for k, (value, _) in seen.items() if course.values[k] > 0]
    shut = sum(course.values[k] == 0 for k in seen)
    # A constant state is the static scene, no motion: a rectangle drawn too wide looks like a leaf half slid away.
    moves = shut >= params.least_frames or (len(opened) > 0 and np.ptp(opened) > params.moves_steps * step)
    if len(opened) < params.least_frames or not moves:
        return None
    turns = course.hypothesis.turns
    sigma_m = min(leaf.sigma_thickness_m, joint.sigma_thicker_m)
    leaf = replace(leaf, thickness_m=leaf.thickness_m + joint.thicker_m, sigma_thickness_m=sigma_m)
    states = _states(leaf, course, joint, seen, scene)
    values = np.array([state.value for state in states.values()], dtype=np.float64)
    pivot = joint.pivot - joint.axis * float(joint.axis @ joint.pivot) if turns else np.zeros(3)
    place = leaf.world_from_front
    return leaf, JointMotion(
        part=part,
        kind="revolute" if turns else "prismatic",
        axis_world=place.turn(joint.axis),
        pivot_world=place.apply(pivot),
        covariance=joint.covariance_in(place.rotation),
        states={scene.frames[k].index: state for k, state in states.items()},
        largest=widest(np.array([value for value, _ in seen.values()]), values, turns=turns),
        source="measured",
    )


def _fitted(leaf: Leaf, course: Course, scene: Scene) -> tuple[FittedJoint, Seen]:
    """Fitted joint, and the states of the frames that determine it."""
    told = [k for k in range(len(scene.frames)) if course.log[k] > tuned(Params).told or course.values[k] == 0]
    if course.hypothesis.lateral:
        found = {k: slid(leaf, course.hypothesis, scene, scene.frames[k]) for k in told}
        return as_supposed(course.hypothesis), {k: state for k, state in found.items() if state is not None}
    fixes = {
        k: fix
        for k in told
        if (fix := fix_plane(leaf, course.hypothesis.pose(float(course.values[k])), scene, scene.frames[k])) is not None
    }
    if not fixes:
        return as_supposed(course.hypothesis), {}
    planes, expected = list(fixes.values()), course.values[list(fixes)]
    joint, states, sigmas = fit_joint(course.hypothesis, planes, expected, leaf.sigma_thickness_m)
    return joint, {k: (float(states[n]), float(sigmas[n])) for n, k in enumerate(fixes)}


def _states(leaf: Leaf, course: Course, joint: FittedJoint, seen: Seen, scene: Scene) -> dict[int, State]:
    """State in every frame that shows the leaf: as fitted, else the likeliest near the neighbouring fits."""
    states: dict[int, State] = {}
    shut = np.pad(course.values == 0, 1, mode="edge")
    rests = shut[:-2] & shut[1:-1] & shut[2:]  # a moving leaf passes the first tested step within a frame or two
    for k, frame in enumerate(scene.frames):
        if k in seen:
            value, sigma = seen[k]
        else:
            value, sigma = _likeliest(leaf, course, joint, seen, scene, k)
        value = _opening(value, joint, float(course.hypothesis.states[1]) if rests[k] else 0.0)
        if k in seen or in_view(leaf, joint.pose(value), scene, frame):
            states[k] = State(value=value, sigma=sigma)
    return states


def _likeliest(leaf: Leaf, course: Course, joint: FittedJoint, seen: Seen, scene: Scene, k: int) -> tuple[float, float]:
    """State and standard deviation of a frame without a fit of its own: it may show the leaf edge-on, or a part of it."""
    params, step = tuned(Params), float(course.hypothesis.states[1])
    beside = [max((j for j in seen if j < k), default=None), min((j for j in seen if j > k), default=None)]
    near = [seen[j][0] for j in beside if j is not None] if course.log[k] < params.sure else []
    low, high = (edge([*near, float(course.values[k])]) for edge in (min, max))
    fine = step / params.finer
    tried = np.arange(max(low - params.around_steps * step, 0.0), high + params.around_steps * step + fine, fine)
    log = evidence(
        lay_out(leaf, replace(course.hypothesis, axis=joint.axis, pivot=joint.pivot, states=tried)),
        scene,
        scene.frames[k],
        edges=True,
    )
    weight = np.exp(log - log.max())
    mean = float(weight @ tried / weight.sum())
    return mean, float(np.sqrt(weight @ (tried - mean) ** 2 / weight.sum() + fine**2))


def _opening(value: float, joint: FittedJoint, rest: float) -> float:
    """State, set to 0 where it is indistinguishable from closed, or at most `rest`."""
    params = tuned(Params)
    return value if value > max(params.closed_rad if joint.turns else params.closed_m, rest) else 0.0
