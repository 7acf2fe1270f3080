"""States of a joint that a person marked in frames: closed here, open by so much there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.motion import JointMotion, State
from r2c2r_core.model.scene import Joint, SceneObject
from r2c2r_core.synthesize.filmed import filmed, opening, widest
from r2c2r_core.synthesize.fixtures.spec import Motion
from r2c2r_core.tuning import param, tuned

Marks = Mapping[int, float]
"""How far a joint stands open, rad or m, by Frame.index."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What is known of the errors of states that were measured, before a person marks any."""

    zero: float = param(
        0.3, "rad", "(m, of what slides) standard deviation of the closed state, of a front that was not filmed closed", gt=0
    )
    scale: float = param(
        0.03,
        "ratio",
        "standard deviation of states to true ones",
        source="a hinge 12 mm off moves the edge of a 0.4 m leaf by 3 %",
    )
    mark: float = param(
        0.01, "rad", "(m, of what slides) standard deviation of a measured state where a person marked another", gt=0
    )
    misread: float = param(
        3.0, "σ", "beyond which a mark says that its frame was misread, and nothing of the others", gt=0, source="1 in 370"
    )


def remarked(item: SceneObject, said: Mapping[str, Marks], motions: Sequence[JointMotion]) -> SceneObject:
    """The object with what its joints did by these marks in place of those that it was built with.

    `said` has them by joint or its part, `motions` are what its track measured. A run says the same of states, and of limits
    that were seen; other limits stay as they were built.
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

    return replace(item, joints=tuple(again(joint) for joint in item.joints))


def part_of(joint: Joint, object_name: str) -> str:
    """Which part of its object the joint moves."""
    return joint.child.removeprefix(f"{object_name}_")


def marks_of(joint: Joint, object_name: str, said: Mapping[str, Marks]) -> Marks:
    """What was marked of a joint, by its name or its part's."""
    return said.get(joint.name) or said.get(part_of(joint, object_name)) or {}


def _opened(joint: Joint, before: JointMotion | None, motion: Motion, most: float) -> Joint:
    """With the limit that follows from what was seen, where that is another than before."""
    seen = joint.motion
    if seen is None or joint.sources["limits"] == "person" or (before is not None and np.isclose(before.largest, seen.largest)):
        return joint
    upper, source = opening(motion, seen, most)
    return joint if source == "default" else replace(joint, upper=upper, sources={**joint.sources, "limits": source})


def as_marked(found: JointMotion | None, marks: Marks, motion: Motion, world_from_object: Rigid3) -> JointMotion | None:
    """The joint with a person's states (rad or m, by Frame.index), and the measured ones moved along with them.

    Of a joint that was not measured, what was marked is all that is known.
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
        stop_seen=False,
        source="person",
    )


def moved(found: JointMotion, marks: Marks) -> JointMotion:
    """What was measured of a joint, with a person's states in their frames and those of other frames moved along.

    Measured states s become a + b s by least squares: a person who says "closed here" moves the zero of all of them, two marks
    also their scale (a ~ N(0, zero), b ~ N(1, scale)). Nothing is further shut than closed.
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
    """Shift and scale of the measured states that meet the marks best.

    A mark that the others and what is known beforehand do not foresee says that its frame was misread: it moves no other.
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
    """Whether frames show it closed, and nobody says otherwise of one of them."""
    closed = {frame for frame, value in states.items() if value <= within}
    return bool(closed - marks.keys()) and all(marks[frame] <= within for frame in closed & marks.keys())
