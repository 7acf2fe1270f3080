"""How a leaf may move: the joints that are tried, each a family of poses of one number, its state."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.tuning import param, tuned

Way = Literal["left", "right", "top", "bottom", "out", "slides_left", "slides_right"]
"""The edge that it hangs on, as a person facing the closed front sees it; out of its unit; or along its own plane."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Which states are tried."""

    most_rad: float = param(float(np.deg2rad(165.0)), "rad", "that a door opens", source="makers' wide-angle hinges: 155-170°")
    most_flap_rad: float = param(
        float(np.deg2rad(120.0)),
        "rad",
        "that a leaf hung on its lower or upper edge opens",
        source="makers: ovens and dishwashers 90°, lift systems up to 110°, and play",
    )
    under_floor_m: float = param(0.02, "m", "that the edge of an open leaf may come out under the floor: errors of its place")
    step_rad: float = param(float(np.deg2rad(3.0)), "rad", "between two angles that are tried", gt=0)
    most_m: float = param(0.75, "m", "that a drawer is drawn out", source="makers' longest runners for kitchens: 600-700 mm")
    step_m: float = param(0.015, "m", "between two places that are tried", gt=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hypothesis:
    """A joint: a line that the leaf turns about, or a direction in which it slides. Front frame; positive opens."""

    way: Way
    axis: Vector3  # unit; right-hand rule for opening
    pivot: Vector3  # a point of the line; what slides has none, and this is 0
    states: np.ndarray  # (q,) that are tried, from 0 up: radians or metres

    @property
    def turns(self) -> bool:
        """Whether it is a hinge."""
        return self.way in ("left", "right", "top", "bottom")

    @property
    def lateral(self) -> bool:
        """Whether it slides within its own plane."""
        return self.way in ("slides_left", "slides_right")

    def pose(self, state: float) -> Rigid3:
        """Where the leaf stands: front_from_leaf, the identity where closed."""
        return moved(self.axis, self.pivot, self.turns, state)

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """The same in all of `states`: rotations (q, 3, 3) and translations (q, 3)."""
        if not self.turns:
            return np.tile(np.eye(3), (len(self.states), 1, 1)), self.states[:, None] * self.axis
        rotations = Rotation.from_rotvec(self.states[:, None] * self.axis).as_matrix()
        return rotations, self.pivot - rotations @ self.pivot


def moved(axis: Vector3, pivot: Vector3, turns: bool, state: float) -> Rigid3:
    """The motion by a joint's state."""
    if not turns:
        return Rigid3(np.eye(3), axis * state)
    rotation = Rotation.from_rotvec(axis * state).as_matrix()
    return Rigid3(rotation, pivot - rotation @ pivot)


def hypotheses(leaf: Leaf, floor_m: float | None = None) -> tuple[Hypothesis, ...]:
    """Every joint that a rectangular leaf may have, over a floor at that height (world z) where one is known."""
    params = tuned(Params)
    half_w, half_h = leaf.half_m
    angles = np.arange(0.0, params.most_rad + 1e-9, params.step_rad)
    flap_angles = angles[angles <= params.most_flap_rad]
    out = np.arange(0.0, params.most_m + 1e-9, params.step_m)
    along = np.arange(0.0, leaf.width_m + 1e-9, params.step_m)
    x, y, z = np.eye(3)
    none = np.zeros(3)
    return (
        Hypothesis(way="left", axis=-z, pivot=-x * half_w, states=angles),
        Hypothesis(way="right", axis=z, pivot=x * half_w, states=angles),
        Hypothesis(way="top", axis=-x, pivot=z * half_h, states=flap_angles),
        Hypothesis(way="bottom", axis=x, pivot=-z * half_h, states=flap_angles[_above(floor_m, leaf, flap_angles)]),
        Hypothesis(way="out", axis=-y, pivot=none, states=out),
        Hypothesis(way="slides_left", axis=-x, pivot=none, states=along),
        Hypothesis(way="slides_right", axis=x, pivot=none, states=along),
    )


def _above(floor_m: float | None, leaf: Leaf, angles: np.ndarray) -> np.ndarray:
    """Whether the free edge of a leaf that hangs on its lower one stays above the floor (q,)."""
    if floor_m is None:
        return np.ones(len(angles), bool)
    hinge_m = leaf.world_from_front.translation[2] - leaf.half_m[1]
    return np.asarray(hinge_m + leaf.height_m * np.cos(angles) > floor_m - tuned(Params).under_floor_m)
