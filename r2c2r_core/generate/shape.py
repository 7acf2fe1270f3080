"""Untextured candidate: a closed surface in a local metric frame with known pose."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.geometry.meshes import Surface
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.track import FrontHandle


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape:
    """A watertight surface in metres."""

    vertices_local: Points
    faces: Faces
    world_from_local: Rigid3
    front_y_m: float | None  # furniture with axis-aligned faces: y of its front face. None: a free object
    maskable: np.ndarray  # per face: whether the track's mask covers it when visible (a front's mask excludes its carcass)
    parameters: dict[str, float]
    warnings: tuple[str, ...]
    handle: FrontHandle | None = None  # modelled on its front, in a `front`-like local frame
    unseen_error_m: float | None = None  # of an unobserved side from its position by scan or category; None: all observed

    @property
    def vertices_world(self) -> Points:
        """The vertices in the world, by the generator's own pose."""
        return self.world_from_local.apply(self.vertices_local)


def thing_model(
    surface: Surface, world_from_local: Rigid3, parameters: dict[str, float], warnings: tuple[str, ...] = ()
) -> Shape:
    """A free object's shape: covered by the masks entirely, without a flat front."""
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
