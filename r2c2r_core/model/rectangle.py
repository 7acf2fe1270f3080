"""Rectangles in space, and their sides as a person facing them sees them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.inputs import HingeSide

TOWARDS: Mapping[HingeSide, Vector3] = {
    "left": np.array([-1.0, 0.0, 0.0]),
    "right": np.array([1.0, 0.0, 0.0]),
    "bottom": np.array([0.0, 0.0, -1.0]),
    "top": np.array([0.0, 0.0, 1.0]),
}
"""Unit vectors from the centre of a front towards its edges, in the `front` frame."""

HINGE_AXES: Mapping[HingeSide, Vector3] = {
    "left": TOWARDS["bottom"],
    "right": TOWARDS["top"],
    "bottom": TOWARDS["right"],
    "top": TOWARDS["left"],
}
"""Axes about which leaves hinged on those edges open, by the right-hand rule."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rectangle3:
    """A rectangle in space, with the `front` frame of transforms.py at its centre."""

    world_from_front: Rigid3
    width_m: float
    height_m: float

    @property
    def centre(self) -> Vector3:
        """Centre, in the world."""
        return self.world_from_front.translation

    @property
    def outward(self) -> Vector3:
        """Unit normal, towards the room."""
        return -self.world_from_front.rotation[:, 1]

    @property
    def half_m(self) -> tuple[float, float]:
        """Half width and half height."""
        return self.width_m / 2, self.height_m / 2

    @property
    def corners_front(self) -> Points:
        """Corners (4, 3) in the front frame: top left, then clockwise."""
        x, z = self.half_m
        return np.array([[-x, 0.0, z], [x, 0.0, z], [x, 0.0, -z], [-x, 0.0, -z]])

    @property
    def corners(self) -> Points:
        """Corners (4, 3) in the world: top left, then clockwise."""
        return self.world_from_front.apply(self.corners_front)

    def covers(self, points_front: Points) -> np.ndarray:
        """Mask (...) of the points (..., 3) of the front frame whose projection along the normal lies inside."""
        x, z = self.half_m
        return np.asarray((np.abs(points_front[..., 0]) < x) & (np.abs(points_front[..., 2]) < z))

    def at(self, front_from_moved: Rigid3) -> Self:
        """The same rectangle moved within its own frame."""
        return replace(self, world_from_front=self.world_from_front @ front_from_moved)

    @staticmethod
    def from_corners(corners_world: Points) -> "Rectangle3":
        """Rectangle with these corners (4, 3): top left, then clockwise."""
        across, up = corners_world[1] - corners_world[0], corners_world[0] - corners_world[3]
        width_m, height_m = float(np.linalg.norm(across)), float(np.linalg.norm(up))
        right = across / width_m
        into = np.cross(up / height_m, right)
        into /= np.linalg.norm(into)
        rotation = np.column_stack([right, into, np.cross(right, into)])
        return Rectangle3(world_from_front=Rigid3(rotation, corners_world.mean(axis=0)), width_m=width_m, height_m=height_m)
