"""Joint hypotheses of a leaf, each a one-parameter family of poses over its state."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3, joint_transform
from r2c2r_core.kitchen.category import Opening
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.rectangle import HINGE_AXES, TOWARDS
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.tuning import param, tuned

Way = HingeSide | Literal["out", "slides_left", "slides_right"]
"""The edge that it hangs on, as a person facing the closed front sees it; out of its unit; or along its own plane."""

USUAL_WAYS: Mapping[Opening, tuple[Way, ...]] = {
    "drawer": ("out",),
    "side": ("left", "right"),
    "bottom": ("bottom",),
    "sideways": ("slides_left", "slides_right"),
}
"""Ways in which the front of a category opens; the doors of a pair are leaves of their own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the tested states."""

    most_rad: float = param(
        float(np.deg2rad(165.0)), "rad", "Maximum opening angle of a door", source="makers' wide-angle hinges: 155-170°"
    )
    most_flap_rad: float = param(
        float(np.deg2rad(120.0)),
        "rad",
        "Maximum opening angle of a leaf hinged on its lower or upper edge",
        source="manufacturers: ovens and dishwashers 90°, lift systems up to 110°, and play",
    )
    under_floor_m: float = param(0.02, "m", "Maximum distance of an open leaf's edge under the floor: position errors")
    step_rad: float = param(float(np.deg2rad(3.0)), "rad", "Step between tested angles", gt=0)
    most_m: float = param(0.75, "m", "Maximum opening of a drawer", source="makers' longest runners for kitchens: 600-700 mm")
    step_m: float = param(0.015, "m", "Step between tested displacements", gt=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hypothesis:
    """A joint: a hinge line, or a sliding direction. Front frame; positive states open."""

    way: Way
    axis: Vector3  # unit; right-hand rule for opening
    pivot: Vector3  # a point on the line; zero for a sliding joint
    states: np.ndarray  # (q,) tested states, from 0 up: radians or metres

    @property
    def turns(self) -> bool:
        """Whether the joint is a hinge."""
        return self.way in HINGE_AXES

    @property
    def lateral(self) -> bool:
        """Whether the leaf slides within its own plane."""
        return self.way in ("slides_left", "slides_right")

    def pose(self, state: float) -> Rigid3:
        """Pose of the leaf in a state: front_from_leaf, the identity where closed."""
        return joint_transform(self.axis, self.pivot, state, turns=self.turns)

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Poses in all of `states`: rotations (q, 3, 3) and translations (q, 3)."""
        if not self.turns:
            return np.tile(np.eye(3), (len(self.states), 1, 1)), self.states[:, None] * self.axis
        rotations = Rotation.from_rotvec(self.states[:, None] * self.axis).as_matrix()
        return rotations, self.pivot - rotations @ self.pivot


def hypotheses(leaf: Leaf, floor_m: float | None = None) -> tuple[Hypothesis, ...]:
    """All joint hypotheses of a rectangular leaf, above a floor at that height (world z) where one is known."""
    params = tuned(Params)
    angles = np.arange(0.0, params.most_rad + 1e-9, params.step_rad)
    flap_angles = angles[angles <= params.most_flap_rad]
    out = np.arange(0.0, params.most_m + 1e-9, params.step_m)
    along = np.arange(0.0, leaf.width_m + 1e-9, params.step_m)
    lowered = flap_angles[_above(floor_m, leaf, flap_angles)]
    swings: dict[HingeSide, np.ndarray] = {"left": angles, "right": angles, "top": flap_angles, "bottom": lowered}
    half, none = leaf.corners_front[1], np.zeros(3)
    return (
        *(Hypothesis(way=k, axis=HINGE_AXES[k], pivot=TOWARDS[k] * half, states=states) for k, states in swings.items()),
        Hypothesis(way="out", axis=np.array([0.0, -1.0, 0.0]), pivot=none, states=out),
        Hypothesis(way="slides_left", axis=TOWARDS["left"], pivot=none, states=along),
        Hypothesis(way="slides_right", axis=TOWARDS["right"], pivot=none, states=along),
    )


def _above(floor_m: float | None, leaf: Leaf, angles: np.ndarray) -> np.ndarray:
    """Mask of the angles (q,) at which the free edge of a leaf hinged on its lower edge stays above the floor."""
    if floor_m is None:
        return np.ones(len(angles), bool)
    hinge_m = leaf.centre[2] - leaf.half_m[1]
    return np.asarray(hinge_m + leaf.height_m * np.cos(angles) > floor_m - tuned(Params).under_floor_m)
