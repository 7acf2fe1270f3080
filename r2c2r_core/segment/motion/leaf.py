"""Movable leaf: the rectangle of a closed front, and sample points on it and around it."""

from dataclasses import dataclass, field, replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.motion import Movement
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
    across: int = param(9, "count", "Number of sample points along each side of the grid on a leaf", ge=3)
    inside: float = param(
        0.9, "share", "Fraction of a leaf's half width and height that the grid spans: its rim is half a depth pixel"
    )
    rim_m: tuple[float, float] = param(
        (0.03, 0.05), "m", "Distances beyond a leaf's edges of the points where it must have ended"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Leaf:
    """A board at its closed pose; `front` frame of transforms.py at the centre of its outer face."""

    world_from_front: Rigid3
    width_m: float
    height_m: float
    thickness_m: float = field(default_factory=lambda: tuned(Params).thickness_m)

    @property
    def outward(self) -> Vector3:
        """Unit normal of the closed outer face, towards the room."""
        return -self.world_from_front.rotation[:, 1]

    def at(self, front_from_leaf: Rigid3) -> "Leaf":
        """Same board at an open pose."""
        return replace(self, world_from_front=self.world_from_front @ front_from_leaf)

    @property
    def behind(self) -> Vector3:
        """Vector from the outer face to the back, in the front frame."""
        return np.array([0.0, self.thickness_m, 0.0])

    @property
    def half_m(self) -> tuple[float, float]:
        """Half width and half height."""
        return self.width_m / 2, self.height_m / 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenLeaf:
    """A leaf at an open pose."""

    leaf: Leaf
    world_from_leaf: Rigid3  # of its outer face, as `front`
    way: Movement  # how it was moved there
    rear_m: float | None = None  # from its outer face to the rear board of the drawer, where that was observed


def face_points(leaf: Leaf) -> Points:
    """Grid of points (n, 3) on the outer face, in the front frame."""
    params = tuned(Params)
    steps = np.linspace(-params.inside, params.inside, params.across)
    x, z = (grid.ravel() for grid in np.meshgrid(steps * leaf.half_m[0], steps * leaf.half_m[1]))
    return np.stack([x, np.zeros_like(x), z], axis=1)


def rim_points(leaf: Leaf, fixed: str | None) -> Points:
    """Points (n, 3) beyond the free edges, in the front frame; `fixed` is the edge of the hinge."""
    params = tuned(Params)
    steps = np.linspace(-params.inside, params.inside, params.across)
    half_w, half_h = leaf.half_m
    rim = []
    for off in params.rim_m:
        sides = {
            "left": (np.full_like(steps, -half_w - off), steps * half_h),
            "right": (np.full_like(steps, half_w + off), steps * half_h),
            "bottom": (steps * half_w, np.full_like(steps, -half_h - off)),
            "top": (steps * half_w, np.full_like(steps, half_h + off)),
        }
        rim += [np.stack([x, np.zeros_like(x), z], axis=1) for side, (x, z) in sides.items() if side != fixed]
    return np.concatenate(rim)


def edge_points(leaf: Leaf, fixed: str | None) -> list[tuple[Points, Vector3, float]]:
    """Per free edge's narrow face: points (n, 3) along its middle, normal, and area per point; in the front frame."""
    params = tuned(Params)
    steps = np.linspace(-params.inside, params.inside, params.across)
    half_w, half_h = leaf.half_m
    level = np.full_like(steps, leaf.thickness_m / 2)
    faces = []
    for side, sign in (("left", -1.0), ("right", 1.0), ("bottom", -1.0), ("top", 1.0)):
        upright = side in ("left", "right")
        x, z = (
            (np.full_like(steps, sign * half_w), steps * half_h)
            if upright
            else (steps * half_w, np.full_like(steps, sign * half_h))
        )
        normal = np.array([sign, 0.0, 0.0] if upright else [0.0, 0.0, sign])
        area = (leaf.height_m if upright else leaf.width_m) * leaf.thickness_m / params.across
        if side != fixed:
            faces.append((np.stack([x, level, z], axis=1), normal, area))
    return faces


def corners(leaf: Leaf) -> Points:
    """Corners (4, 3) of the outer face in the front frame: top left, then clockwise."""
    half_w, half_h = leaf.half_m
    return np.array([[-half_w, 0.0, half_h], [half_w, 0.0, half_h], [half_w, 0.0, -half_h], [-half_w, 0.0, -half_h]])
