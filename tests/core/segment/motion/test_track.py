from typing import Any

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.motion import DRAWER
from r2c2r_core.segment.motion.filmed import FilmedLeaves
from r2c2r_core.segment.motion.hypotheses import hypotheses
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.motion.track import find_motion
from r2c2r_core.synthesize.filmed import opening
from r2c2r_core.synthesize.fixtures.spec import Motion
from tests.core.segment.motion.boards import LEAF, filmed, joint

RAD, M = ("left", "right", "top", "bottom"), ("out", "slides_left", "slides_right")


def opened_and_held(largest: float) -> np.ndarray:
    """States of a leaf: closed, opened slowly, held, and half closed again."""
    return np.concatenate(
        [np.zeros(8), np.linspace(0, largest, 12), np.full(10, largest), np.linspace(largest, largest / 2, 5)]
    )


def scene(*args: Any, **more: Any) -> Any:
    return filmed(*args, **more)


def motion_of(*args: Any, **more: Any) -> Any:
    return find_motion(*args, **more)[1]


def quick(ways: tuple[str, ...], few: tuple[str, ...]) -> list[Any]:
    """The few kinds of motion that differ; their mirror images are slow."""
    return [pytest.param(way, marks=() if way in few else pytest.mark.slow) for way in ways]


@pytest.mark.parametrize("way", quick(RAD + M, ("left", "bottom", "out", "slides_left")))
def test_each_joint_type_is_classified_and_measured(way: str) -> None:
    states = opened_and_held(np.deg2rad(75) if way in RAD else 0.33)
    motion = motion_of(LEAF, scene(way, states))
    assert motion is not None
    assert motion.kind == ("revolute" if way in RAD else "prismatic")
    axis = LEAF.world_from_front.turn(joint(way).axis)
    assert motion.axis_world is not None
    assert np.degrees(np.arccos(min(float(motion.axis_world @ axis), 1.0))) < 0.5
    values = np.array([motion.states[k].value for k in range(len(states))], dtype=float)
    assert np.quantile(np.abs(values - states), 0.95) < (np.deg2rad(2) if way in RAD else 0.008)  # a depth pixel is 11 mm
    assert motion.largest == pytest.approx(states.max(), abs=np.deg2rad(1) if way in RAD else 0.006)


def test_a_leaf_resting_almost_closed_counts_as_closed() -> None:
    """Pose errors rotate all depth of a closed leaf by more than the noise of a single frame."""
    states = np.maximum(opened_and_held(np.deg2rad(75)), np.deg2rad(2.6))
    motion = motion_of(LEAF, scene("left", states))
    assert motion is not None
    assert [motion.states[k].value for k in range(7)] == [0.0] * 7
    assert motion.states[9].value == pytest.approx(states[9], abs=np.deg2rad(2))  # while moving it is where it was observed


def test_flap_hypotheses_are_limited_to_120_degrees() -> None:
    assert max(joint(way).states.max() for way in ("top", "bottom")) <= np.deg2rad(120) < joint("left").states.max()


@pytest.mark.parametrize("way", quick(RAD, ("left", "top")))
def test_a_concealed_hinge_is_located_behind_the_edge(way: str) -> None:
    """A concealed hinge turns about a line inside the unit, far from the usual one; three ranges of angles determine it."""
    off = (0.012, 0.015, 0.0) if way in ("left", "right") else (0.0, 0.015, 0.012)
    states = np.concatenate([np.zeros(4), np.linspace(0, np.deg2rad(95), 45)])
    motion = motion_of(LEAF, scene(way, states, pivot_off=off, noise_m=0.003))
    assert motion is not None
    assert motion.pivot_world is not None
    assert motion.covariance is not None
    found = LEAF.world_from_front.inverse.apply(motion.pivot_world) - joint(way).pivot
    axis = joint(way).axis
    error = np.array(off) - found
    error -= axis * (axis @ error)
    assert np.linalg.norm(error) < 0.005
    spread = np.sqrt(np.trace(motion.covariance[3:, 3:]))
    assert 0.0005 < spread < 0.006


def test_a_static_leaf_has_no_motion() -> None:
    assert motion_of(LEAF, scene("left", np.zeros(30))) is None


def test_an_arm_before_a_closed_leaf_is_not_reported_as_motion() -> None:
    assert motion_of(LEAF, scene("left", np.zeros(30), hands=range(5, 20))) is None


def test_an_arm_before_an_open_leaf_does_not_change_its_joint() -> None:
    states = opened_and_held(np.deg2rad(60))
    motion = motion_of(LEAF, scene("right", states, hands=range(8, 24, 2)))
    assert motion is not None
    assert motion.largest == pytest.approx(np.deg2rad(60), abs=np.deg2rad(1))
    values = np.array([motion.states[k].value for k in range(len(states))], dtype=float)
    assert np.quantile(np.abs(values - states), 0.95) < np.deg2rad(2)


HELD_THEN_CLOSED = np.concatenate([np.full(12, 1.2), np.linspace(1.2, 0, 12), np.zeros(6)])


@pytest.mark.parametrize(
    "states", [np.linspace(1.2, 0, 30), np.linspace(0, 1.2, 30), np.repeat([0.0, 1.2], 15), HELD_THEN_CLOSED]
)
def test_partly_filmed_openings_are_tracked(states: np.ndarray) -> None:
    motion = motion_of(LEAF, scene("left", states))
    assert motion is not None
    values = np.array([motion.states[k].value for k in range(len(states))], dtype=float)
    assert np.quantile(np.abs(values - states), 0.9) < np.deg2rad(2)


@pytest.mark.parametrize(("way", "held", "usual"), [("left", np.deg2rad(55), np.deg2rad(115)), ("out", 0.354, 0.45)])
def test_a_hand_that_holds_a_leaf_still_is_not_its_stop(way: str, held: float, usual: float) -> None:
    """A joint that ended where a hand paused would open half way in every simulation."""
    found = motion_of(LEAF, scene(way, opened_and_held(held)))
    unit = Motion(
        part="door",
        type="revolute" if way in RAD else "prismatic",
        origin_object=np.zeros(3),
        axis_object=joint(way).axis,
        upper=usual,
    )
    assert opening(unit, found, most=2 * usual) == (usual, "default")


def test_a_pause_on_the_way_does_not_end_the_motion() -> None:
    pause, end = np.deg2rad((40, 75))
    way = (np.zeros(6), np.linspace(0, pause, 6), np.full(10, pause), np.linspace(pause, end, 6), np.full(4, end))
    motion = motion_of(LEAF, scene("left", np.concatenate(way)))
    assert motion is not None
    assert motion.largest == pytest.approx(end, abs=np.deg2rad(1))


def test_evidence_overrides_a_wrong_prior() -> None:
    motion = motion_of(LEAF, scene("left", opened_and_held(1.0)), {"out": 8.0})
    assert motion is not None
    assert motion.kind == "revolute"


@pytest.mark.parametrize("way", ["left", "slides_left"])
def test_a_constant_open_state_is_not_reported_as_motion(way: str) -> None:
    """A rectangle drawn too wide looks like a leaf that is half slid away: only a change of state is evidence of a joint."""
    assert motion_of(LEAF, scene(way, np.full(30, 0.3))) is None


def test_a_leaf_of_a_pair_must_open_about_the_given_side() -> None:
    states = opened_and_held(1.0)
    assert motion_of(LEAF, scene("bottom", states), {"left": 8.0}, "left", only=True) is None
    assert motion_of(LEAF, scene("left", states), {"left": 8.0}, "left", only=True) is not None


def test_another_leaf_in_the_opened_position_is_not_reported_as_motion() -> None:
    """The other leaf only hides the front; an open door would reveal the inside of its unit."""
    assert motion_of(LEAF, scene("left", np.zeros(36), other=range(10, 26))) is None


def test_static_appliances_beside_a_leaf_are_not_reported_as_motion() -> None:
    """One appliance stands where an open door would be, the other hides the closed door, both in every frame."""
    assert motion_of(LEAF, scene("left", np.zeros(36), niche=True)) is None


def test_a_board_that_stands_beside_a_leaf_is_not_taken_for_it() -> None:
    """While the leaf is edge-on, a board that leans on the neighbouring front would explain an angle of 160 degrees better."""
    turn = np.linspace(0, np.deg2rad(80), 8)
    states = np.concatenate([np.zeros(10), turn, np.full(4, turn[-1]), turn[::-1], np.zeros(10)])
    motion = motion_of(LEAF, scene("left", states, leans=True))
    assert motion is not None
    values = np.array([motion.states[k].value for k in range(len(states))], dtype=float)
    assert np.abs(values - states).max() < np.deg2rad(2)


def test_black_glass_counts_as_closed_where_it_has_no_depth() -> None:
    """The outer face of an oven door has no depth returns, its inner face has."""
    states = opened_and_held(1.4)
    motion = motion_of(LEAF, scene("bottom", states, glass=True))
    assert motion is not None
    assert [motion.states[k].value for k in range(8)] == [0.0] * 8
    held = np.array([motion.states[k].value for k in range(20, 30)], dtype=float)
    assert np.quantile(np.abs(held - 1.4), 0.9) < np.deg2rad(2)


def test_a_drawer_below_a_door_is_tracked_as_a_separate_leaf() -> None:
    whole = Leaf(
        world_from_front=LEAF.world_from_front @ Rigid3(np.eye(3), np.array([0.0, 0.0, 0.15])), width_m=0.5, height_m=0.9
    )
    film = scene("out", opened_and_held(0.3))
    (drawer,) = FilmedLeaves(whole, category_of("refrigerator"), film, 0.6, (LEAF.half_m[1] - 0.15,)).motions
    assert (drawer.part, drawer.kind) == (DRAWER, "prismatic")
    assert drawer.pivot_world is not None
    np.testing.assert_allclose(drawer.pivot_world, LEAF.world_from_front.translation, atol=1e-6)  # its own centre
    assert drawer.largest == pytest.approx(0.3, abs=0.006)


def test_a_swinging_door_is_not_reported_as_a_drawer_below_a_seam() -> None:
    film = scene("left", opened_and_held(1.2))
    (door,) = FilmedLeaves(LEAF, category_of("refrigerator"), film, 0.6, (-0.1,)).motions
    assert (door.part, door.kind) == ("", "revolute")


def test_a_bottom_hinged_leaf_opens_at_most_to_the_floor() -> None:
    def widest(floor_m: float | None) -> float:
        return float(next(one for one in hypotheses(LEAF, floor_m) if one.way == "bottom").states[-1])

    assert widest(None) == pytest.approx(np.deg2rad(117.0))  # the last of the tested steps
    bottom = float(LEAF.world_from_front.translation[2]) - LEAF.half_m[1]
    assert np.pi / 2 < widest(bottom - 0.1) < widest(bottom - 0.2) < widest(None)


@pytest.mark.parametrize("thickness_m", [0.03, 0.06])
def test_motion_shows_the_thickness_of_an_appliance_door(thickness_m: float) -> None:
    film: Any = filmed("left", opened_and_held(np.deg2rad(110)), thickness_m=thickness_m)
    leaf, motion = find_motion(Leaf.of_appliance(LEAF), film)
    assert motion is not None
    assert leaf.thickness_m == pytest.approx(thickness_m, abs=0.005)
    assert leaf.sigma_thickness_m < Leaf.of_appliance(LEAF).sigma_thickness_m / 2
    hinge = LEAF.world_from_front.inverse.apply(motion.pivot_world)
    assert hinge[:2] == pytest.approx([-LEAF.half_m[0], 0.0], abs=0.006)
