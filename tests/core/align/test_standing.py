"""Stable upright poses of an object."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.align.standing import hull_directions, settled_on_base, standing_directions

UP = np.array([0.0, 0.0, 1.0])


def cup(*, handle: bool = True, count: int = 6000) -> np.ndarray:
    """Points all over a cup of 8 cm across and 9 cm high, with 1 mm of noise; the handle is a ring on one side."""
    rng = np.random.default_rng(0)
    angle, share = rng.uniform(0, 2 * np.pi, count), rng.uniform(0, 1, count)
    round_ = np.column_stack([np.cos(angle), np.sin(angle)])
    wall = np.column_stack([0.04 * round_, 0.09 * share])
    base = np.column_stack([0.04 * round_ * np.sqrt(share)[:, None], np.zeros(count)])[: count // 3]
    ring = np.column_stack([0.04 + 0.025 * np.abs(round_[:, 0]), 0.006 * rng.normal(size=count), 0.045 + 0.03 * round_[:, 1]])
    parts = [wall, base, ring[: count // 4]] if handle else [wall, base]
    points = np.concatenate(parts)
    return points + rng.normal(0, 0.001, points.shape)


def off_deg(direction: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.degrees(np.arccos(min(float(direction @ wanted), 1.0))))


@pytest.mark.parametrize("seed", range(3))
def test_a_cup_stands_perpendicular_to_its_base_despite_tilted_box_axes(seed: int) -> None:
    turn = Rotation.random(random_state=seed).as_matrix()
    box_axes = turn @ Rotation.from_euler("y", 7, degrees=True).as_matrix()
    points = cup() @ turn.T
    ups, bases = standing_directions(points, (box_axes,), 0.3, hull_directions(points, 8))
    assert min(off_deg(base, turn @ UP) for base in bases) < 1.0  # 1 mm of noise over a base of 8 cm
    assert min(off_deg(up, turn @ UP) for up in ups) < 1.0
    assert all(off_deg(a, b) > 10 for k, a in enumerate(ups) for b in ups[:k])


def test_reliable_box_axes_take_precedence_over_the_base() -> None:
    points = cup(handle=False)
    axes = Rotation.from_euler("y", 2, degrees=True).as_matrix()
    _, bases = standing_directions(points, (axes,), 0.9, hull_directions(points, 8))
    assert min(off_deg(base, axes[:, 2]) for base in bases) < 1e-6


@pytest.mark.parametrize("lean_deg", [25.0, 40.0])
def test_a_toppling_pose_is_not_settled(lean_deg: float) -> None:
    leaning = Rotation.from_euler("x", lean_deg, degrees=True).as_matrix() @ UP
    assert settled_on_base(cup(handle=False), leaning) is None


def test_a_cup_on_its_round_side_is_not_settled() -> None:
    assert settled_on_base(cup(handle=False), np.array([1.0, 0.0, 0.0])) is None


def test_four_legs_are_stable_and_two_on_one_side_are_not() -> None:
    rng = np.random.default_rng(1)
    seat = rng.uniform([-0.2, -0.2, 0.44], [0.2, 0.2, 0.47], (4000, 3))
    legs = {
        (x, y): rng.uniform([x - 0.02, y - 0.02, 0.0], [x + 0.02, y + 0.02, 0.44], (800, 3))
        for x in (-0.18, 0.18)
        for y in (-0.18, 0.18)
    }
    settled = settled_on_base(np.concatenate([seat, *legs.values()]), UP)
    assert settled is not None
    assert off_deg(settled, UP) < 1.0  # some 40 points per leg touch the floor
    pair = [leg for (x, _), leg in legs.items() if x > 0]
    assert settled_on_base(np.concatenate([seat, *pair]), UP) is None
