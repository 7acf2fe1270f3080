"""Movable leaf: the rectangle of a closed front, and sample points on it and around it."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.motion import Movement
from r2c2r_core.model.rectangle import TOWARDS, Rectangle3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of a leaf's sample points."""

    thickness_m: float = param(
        0.019,
        "m",
        "Thickness of a front's board where it was not measured",
        source="European manufacturers' lists: fronts of 16-22 mm",
    )
    sigma_thickness_m: float = param(
        0.003, "m", "Standard deviation of a board's thickness", source="manufacturers' lists: fronts of 16-22 mm"
    )
    appliance_m: float = param(
        0.045, "m", "Thickness of an appliance's door where it was not measured", source="microwaves 30 mm, refrigerators 60 mm"
    )
    sigma_appliance_m: float = param(0.02, "m", "Standard deviation of the thickness of an appliance's door")
    across: int = param(9, "count", "Number of sample points along each side of the grid on a leaf", ge=3)
    inside: float = param(
        0.9, "share", "Fraction of a leaf's half width and height that the grid spans: its rim is half a depth pixel"
    )
    rim_m: tuple[float, float] = param(
        (0.03, 0.05), "m", "Distances beyond a leaf's edges of the points where it must have ended"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Leaf(Rectangle3):
    """A board: the rectangle of its outer face, closed or open, and its thickness."""

    thickness_m: float = field(default_factory=lambda: tuned(Params).thickness_m)
    sigma_thickness_m: float = field(default_factory=lambda: tuned(Params).sigma_thickness_m)

    @property
    def behind(self) -> Vector3:
        """Vector from the outer face to the back, in the front frame."""
        return np.array([0.0, self.thickness_m, 0.0])

    @staticmethod
    def of(face: Rectangle3) -> "Leaf":
        """Board of usual thickness with that outer face."""
        return Leaf(world_from_front=face.world_from_front, width_m=face.width_m, height_m=face.height_m)

    @staticmethod
    def of_appliance(face: Rectangle3) -> "Leaf":
        """Door of an appliance with that outer face: thicker than a board, by an amount that motion shows."""
        params = tuned(Params)
        return replace(Leaf.of(face), thickness_m=params.appliance_m, sigma_thickness_m=params.sigma_appliance_m)

    def part(self, x_m: tuple[float, float], z_m: tuple[float, float]) -> "Leaf":
        """Part between two places across and two heights, in the front frame."""
        moved = self.at(Rigid3(np.eye(3), np.array([sum(x_m) / 2, 0.0, sum(z_m) / 2])))
        return replace(moved, width_m=x_m[1] - x_m[0], height_m=z_m[1] - z_m[0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenLeaf:
    """A leaf at an open pose, and how it was moved there."""

    leaf: Leaf
    movement: Movement
    out_m: float  # how far a drawer was drawn out: its state
    rear_m: float | None = None  # from its outer face to the rear board of the drawer, where that was observed


def face_points(leaf: Leaf) -> Points:
    """Grid of points (n, 3) on the outer face, in the front frame."""
    x, z = (grid.ravel() for grid in np.meshgrid(_steps() * leaf.half_m[0], _steps() * leaf.half_m[1]))
    return np.stack([x, np.zeros_like(x), z], axis=1)


def rim_points(leaf: Leaf, fixed: str | None) -> Points:
    """Points (n, 3) beyond the free edges, in the front frame; `fixed` is the edge of the hinge."""
    edges = list(_free_edges(leaf, fixed))
    return np.concatenate([points + off * towards for off in tuned(Params).rim_m for towards, points in edges])


def edge_points(leaf: Leaf, fixed: str | None) -> list[tuple[Points, Vector3, float]]:
    """Per free edge's narrow face: points (n, 3) along its middle, normal, and area per point; in the front frame."""
    area_m2 = np.array([leaf.height_m, 0.0, leaf.width_m]) * leaf.thickness_m / tuned(Params).across
    edges = _free_edges(leaf, fixed)
    return [(points + leaf.behind / 2, towards, float(np.abs(towards) @ area_m2)) for towards, points in edges]


def _free_edges(leaf: Leaf, fixed: str | None) -> Iterator[tuple[Vector3, Points]]:
    """Per edge except the fixed one: unit vector towards it, and points (n, 3) along it."""
    half = leaf.corners_front[1]
    for side, towards in TOWARDS.items():
        if side != fixed:
            yield towards, half * (towards + (1 - np.abs(towards)) * _steps()[:, None])


def _steps() -> np.ndarray:
    """Places of the sample points along a side, -1 to 1."""
    params = tuned(Params)
    return np.linspace(-params.inside, params.inside, params.across)
