"""A candidate before it gets its picture: a closed surface in a local metric frame whose place the generator knows."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.geometry.meshes import Surface
from r2c2r_core.geometry.transforms import Rigid3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape:
    """A watertight surface in metres."""

    vertices_local: Points
    faces: Faces
    world_from_local: Rigid3
    front_y_m: float | None  # furniture: where its front face lies; it is made of flat faces along the axes. None: a thing
    maskable: np.ndarray  # per face: whether the track's mask covers it when it is seen (a front's mask leaves out its carcass)
    parameters: dict[str, float]
    warnings: tuple[str, ...]
    unseen_error_m: float | None = (
        None  # how far a side that nobody saw lies from where scan or category have it; None: all seen
    )

    @property
    def vertices_world(self) -> Points:
        """The vertices where the generator believes they are."""
        return self.world_from_local.apply(self.vertices_local)


def thing_model(
    surface: Surface, world_from_local: Rigid3, parameters: dict[str, float], warnings: tuple[str, ...] = ()
) -> Shape:
    """A thing's shape: all of it is in the masks, and none of it is a flat front."""
    vertices, faces = surface
    return Shape(
        vertices_local=vertices,
        faces=faces,
        world_from_local=world_from_local,
        front_y_m=None,
        maskable=np.ones(len(faces), dtype=bool),
        parameters={"revolved": 0.0, "mirrored": 0.0, **parameters},
        warnings=warnings,
    )
