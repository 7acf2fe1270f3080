"""Joint states marked by a person in frames: closed here, open by a given amount there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.motion import JointMotion, State
from r2c2r_core.model.scene import Joint, SceneObject
from r2c2r_core.synthesize.filmed import filmed, opened_alike, opening, widest
from r2c2r_core.synthesize.fixtures.spec import Motion
from r2c2r_core.tuning import param, tuned

Marks = Mapping[int, float]
"""Joint state, rad or m, by Frame.index."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned priors on the errors of measured joint states."""

    zero: float = param(
        0.3,
        "rad",
        "Standard deviation of the closed state, in m for sliding parts, of a front that was not filmed closed",
        gt=0,
    )
    scale: float = param(
        0.03,
        "ratio",
        "Standard deviation of the ratio of measured to true states",
        source="a hinge 12 mm off moves the edge of a 0.4 m leaf by 3 %",
    )
    mark: float = param(0.01, "rad", "Standard deviation of a measured state in a marked frame, in m for sliding parts", gt=0)
    misread: float = param(
        3.0, "σ", "Residual above which a mark shows that only its frame was misread", gt=0, source="1 in 370"
    )


def remarked(item: SceneObject, said: Mapping[str, Marks], motions: Sequence[JointMotion]) -> SceneObject:
    """The object with joints re-estimated from these marks.

    `said` has them by joint or its part, `motions` are what its track measured. A run gives the same states, and the same
    limits where they were observed; other limits stay as they were built.
    """
    placed_pose = item.final_from_placed.inverse @ item.world_from_object

    def again(joint: Joint) -> Joint:
        part = part_of(joint, item.name)
        marks = marks_of(joint, item.name, said)
        motion = Motion(
            part=part,
            type=joint.type,
            origin_object=joint.origin_object,
            axis_object=joint.axis_object,
            upper=joint.upper if joint.sources["limits"] == "default" else 0.0,
        )
        seen = as_marked(filmed(motions, placed_pose, motion), marks, motion, placed_pose)
        return _opened(
            replace(joint, motion=seen), joint.motion, motion, widest(joint.axis_object, joint.type, item.dimensions_m)
        )

    return replace(item, joints=tuple(opened_alike([again(joint) for joint in item.joints])))


def part_of(joint: Joint, object_name: str) -> str:
    """Name of the part of its object that the joint moves."""
    return joint.child.removeprefix(f"{object_name}_")


def marks_of(joint: Joint, object_name: str, said: Mapping[str, Marks]) -> Marks:
    """Marks of a joint, by its name or its part's."""
    return said.get(joint.name) or said.get(part_of(joint, object_name)) or {}


def _opened(joint: Joint, before: JointMotion | None, motion: Motion, most: float) -> Joint:
    """The joint with the limit that follows from its observed motion, where that has changed."""
    seen = joint.motion
    if seen is None or joint.sources["limits"] == "person" or (before is not None and np.isclose(before.largest, seen.largest)):
        return joint
    upper, source = opening(motion, seen, most)
    return joint if source == "default" else replace(joint, upper=upper, sources={**joint.sources, "limits": source})


def as_marked(found: JointMotion | None, marks: Marks, motion: Motion, world_from_object: Rigid3) -> JointMotion | None:
    """The joint's motion with a person's states (rad or m, by Frame.index), and the measured ones corrected accordingly.

    For a joint that was not measured, the marks are the only data.
    """
    if not marks:
        return found
    if found is not None:
        return moved(found, marks)
    return JointMotion(
        part=motion.part,
        kind=motion.type,
        axis_world=world_from_object.turn(motion.axis_object),
        pivot_world=world_from_object.apply(motion.origin_object),
        covariance=None,
        states=_said(marks),
        largest=max(0.0, *marks.values()),
        source="person",
    )


def moved(found: JointMotion, marks: Marks) -> JointMotion:
    """A joint's measured motion, with a person's states in their frames and corrected states in the others.

    Measured states s become a + b s by least squares: a mark "closed here" shifts the zero of all of them, two marks also
    change their scale (a ~ N(0, zero), b ~ N(1, scale)). No state is below closed.
    """
    zero, scale = _correction(found, marks)
    along = {
        frame: state if state.value is None else replace(state, value=max(0.0, zero + scale * state.value))
        for frame, state in found.states.items()
    }
    states = dict(sorted({**along, **_said(marks)}.items()))
    return replace(found, states=states, largest=max(0.0, *(s.value for s in states.values() if s.value is not None)))


def _said(marks: Marks) -> dict[int, State]:
    return {frame: State(value=value, sigma=None) for frame, value in sorted(marks.items())}


def _correction(found: JointMotion, marks: Marks) -> tuple[float, float]:
    """Offset and scale of the measured states that best fit the marks.

    A mark that the others and the prior do not predict shows that its frame was misread: it is rejected as an outlier.
    """
    params = tuned(Params)
    states = {frame: state.value for frame, state in found.states.items() if state.value is not None}
    pairs = [(states[frame], value) for frame, value in marks.items() if frame in states]
    measured, true = np.array(pairs).reshape(-1, 2).T
    rows, off = np.column_stack([np.ones(len(pairs)), measured]) / params.mark, (true - measured) / params.mark
    prior = np.diag(np.array([params.mark if _was_closed(states, marks, params.mark) else params.zero, params.scale]) ** -2.0)
    while len(rows):
        known, pull = prior + rows.T @ rows, rows.T @ off
        others = known - rows[:, :, None] * rows[:, None, :]
        foreseen = np.linalg.solve(others, (pull - rows * off[:, None])[..., None])[..., 0]
        spread = 1.0 + np.einsum("ni,nij,nj->n", rows, np.linalg.inv(others), rows)
        surprise = np.abs(off - (rows * foreseen).sum(axis=1)) / np.sqrt(spread)
        worst = int(np.argmax(surprise))
        if surprise[worst] <= params.misread:
            zero, more = np.linalg.solve(known, pull)
            return float(zero), float(1 + more)
        rows, off = np.delete(rows, worst, axis=0), np.delete(off, worst)
    return 0.0, 1.0


def _was_closed(states: Marks, marks: Marks, within: float) -> bool:
    """Whether frames show it closed, and no mark contradicts one of them."""
    closed = {frame for frame, value in states.items() if value <= within}
    return bool(closed - marks.keys()) and all(marks[frame] <= within for frame in closed & marks.keys())
