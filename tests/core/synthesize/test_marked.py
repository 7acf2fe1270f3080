"""States marked by a person adjust the measured ones."""

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.inputs import ObjectOverride, Overrides
from r2c2r_core.model.motion import JointMotion, State
from r2c2r_core.synthesize.corrected import differs
from r2c2r_core.synthesize.fixtures.spec import Motion
from r2c2r_core.synthesize.marked import as_marked, remarked
from tests.core.synthesize.kitchen_units import Unit
from tests.core.synthesize.test_build_scene import built

HINGE = Motion(part="door", type="revolute", origin_object=np.zeros(3), axis_object=np.array([0.0, 0.0, 1.0]), upper=1.5)


def measured(values: dict[int, float | None]) -> JointMotion:
    return JointMotion(
        kind="revolute",
        axis_world=np.array([0.0, 0.0, 1.0]),
        pivot_world=np.zeros(3),
        covariance=np.eye(6) * 1e-6,
        states={frame: State(value=value, sigma=None if value is None else 0.01) for frame, value in values.items()},
        largest=max(v for v in values.values() if v is not None),
        source="measured",
    )


def values(motion: JointMotion | None) -> dict[int, float | None]:
    assert motion is not None
    return {frame: state.value for frame, state in motion.states.items()}


def test_motions_without_marks_are_unchanged() -> None:
    found = measured({0: 0.1, 5: 1.0})
    assert as_marked(found, {}, HINGE, Rigid3()) is found
    assert as_marked(None, {}, HINGE, Rigid3()) is None


def test_a_closed_mark_shifts_the_zero_of_every_frame() -> None:
    moved = as_marked(measured({0: 0.1, 5: 1.0, 9: None}), {0: 0.0}, HINGE, Rigid3())
    assert values(moved) == {0: 0.0, 5: pytest.approx(0.9, abs=0.005), 9: None}
    assert moved is not None
    assert moved.largest == pytest.approx(0.9, abs=0.005)
    assert moved.states[0].sigma is None  # marks of a person have no uncertainty


def test_two_marks_rescale_the_measured_states() -> None:
    moved = as_marked(measured({0: 0.1, 5: 1.0, 8: 0.55}), {0: 0.0, 5: 0.95}, HINGE, Rigid3())
    assert values(moved) == {0: 0.0, 5: 0.95, 8: pytest.approx(0.475, abs=0.015)}


def test_a_contradicting_mark_changes_only_its_own_frame() -> None:
    """Only one frame was measured wrong: the others keep their values."""
    found = measured({0: 0.0, 3: 0.0, 5: 1.4, 8: 0.9})
    assert values(as_marked(found, {5: 0.0}, HINGE, Rigid3())) == {0: 0.0, 3: 0.0, 5: 0.0, 8: 0.9}
    odd = as_marked(measured({0: 0.1, 5: 1.0, 8: 0.6}), {0: 0.0, 5: 0.9, 8: 0.0}, HINGE, Rigid3())
    assert values(odd) == {0: 0.0, 5: 0.9, 8: 0.0}


def test_an_open_mark_on_a_closed_frame_shifts_all_states() -> None:
    """The leaf was open from the start: the state measured as closed was an open one."""
    found = measured({0: 0.0, 3: 0.0, 5: 0.7})
    moved = as_marked(found, {0: 0.5}, HINGE, Rigid3())
    assert values(moved) == {0: 0.5, 3: pytest.approx(0.5, abs=0.005), 5: pytest.approx(1.2, abs=0.005)}


def test_shifted_states_are_clamped_at_closed() -> None:
    moved = as_marked(measured({0: 0.1, 4: 0.2, 5: 1.0}), {4: 0.0}, HINGE, Rigid3())
    assert values(moved) == {0: 0.0, 4: 0.0, 5: pytest.approx(0.8, abs=0.005)}


def test_marks_on_a_built_object_give_the_same_result_as_a_run() -> None:
    marks = {"door": {7: 0.0, 30: 2.0}}
    unit = Unit("a", "cabinet", (0, 0, 0.45), (0.6, 0.58, 0.72))
    plain = built(unit).objects[0]
    run = built(unit, overrides=Overrides(objects={"a": ObjectOverride(states=marks)})).objects[0]
    shown = remarked(plain, marks, ())
    assert values(shown.joints[0].motion) == values(run.joints[0].motion)
    for joint in (shown.joints[0], run.joints[0]):
        assert (joint.upper, joint.sources["limits"]) == (2.0, "at_least")
    assert not differs(run, remarked(run, marks, ()))
    assert remarked(run, {}, ()).joints[0].motion is None
    named = remarked(plain, {plain.joints[0].name: marks["door"]}, ())
    assert values(named.joints[0].motion) == values(run.joints[0].motion)


def test_a_mark_on_one_door_of_a_pair_opens_both_as_far_as_a_run_does() -> None:
    marks = {"left_door": {30: 2.0}}
    unit = Unit("a", "double_door_cabinet", (0, 0, 0.45), (0.8, 0.58, 0.72))
    run = built(unit, overrides=Overrides(objects={"a": ObjectOverride(states=marks)})).objects[0]
    for item in (run, remarked(built(unit).objects[0], marks, ())):
        assert [(joint.upper, joint.sources["limits"]) for joint in item.joints] == [(2.0, "at_least")] * 2


def test_marks_alone_define_the_motion_of_an_unmeasured_joint() -> None:
    item = built(
        Unit("a", "cabinet", (0, 0, 0.45), (0.6, 0.58, 0.72)),
        overrides=Overrides(objects={"a": ObjectOverride(states={"door": {7: 0.0, 30: 2.0}, "lid": {1: 0.0}})}),
    ).objects[0]
    motion = item.joints[0].motion
    assert motion is not None
    assert (values(motion), motion.source, motion.covariance) == ({7: 0.0, 30: 2.0}, "person", None)
    np.testing.assert_allclose(np.abs(motion.axis_world), [0, 0, 1], atol=1e-9)
    assert item.joints[0].upper == 2.0  # it was seen to open further than its category's usual limit
    assert item.joints[0].sources["limits"] == "at_least"
    assert any("corrections of a joint lid were not used" in line for line in item.warnings)
