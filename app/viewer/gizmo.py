"""Transform controls for one object in the 3D view, with its box and mesh as children that follow in the browser.

viser's controls have all rings or none, but a ring is only shown with both its arrows. So the lower control has right, back
and the ring about the vertical, and the upper one, its child, has up.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser.transforms as vtf

from app.viewer.boxes import box_edges
from r2c2r_core.geometry.transforms import Rigid3

NODE = "/moved/up"  # parent of the moved nodes
_FRONT, _SIDE = (255, 225, 77), (242, 245, 250)


@dataclass(frozen=True, slots=True)
class Gizmo:
    """Both transform controls."""

    lower: Any
    upper: Any

    @property
    def pose(self) -> Rigid3:
        """Current pose: world_from_object."""
        return _pose(self.lower) @ _pose(self.upper)

    def put(self, world_from_object: Rigid3) -> None:
        """Set the pose of the controls and their children."""
        self.lower.wxyz = vtf.SO3.from_matrix(world_from_object.rotation).wxyz
        self.lower.position = world_from_object.translation
        self.upper.position = np.zeros(3)

    def remove(self) -> None:
        """Remove the controls and their children."""
        self.lower.remove()


def add(scene: Any, world_from_object: Rigid3, size_m: Sequence[float]) -> Gizmo:
    """Arrows along the object's own axes, a ring about its vertical, and its box with the front in another colour."""
    look: dict[str, Any] = {"scale": max(0.8 * max(size_m), 0.3), "disable_sliders": True, "depth_test": False}
    lower = scene.add_transform_controls("/moved", active_axes=(True, True, False), **look)
    upper = scene.add_transform_controls(NODE, active_axes=(False, False, True), disable_rotations=True, **look)
    half = np.asarray(size_m) / 2
    ends = box_edges(-half, half)
    front = np.all(ends[:, :, 1] < 0, axis=1)  # the object's front is at -Y
    colours = np.where(np.reshape(front, (-1, 1, 1)), np.array(_FRONT), np.array(_SIDE)).astype(np.uint8)
    scene.add_line_segments(f"{NODE}/box", ends, np.broadcast_to(colours, (len(ends), 2, 3)), thickness=0.006)
    handles = Gizmo(lower, upper)
    handles.put(world_from_object)
    return handles


def _pose(handle: Any) -> Rigid3:
    return Rigid3(vtf.SO3(np.asarray(handle.wxyz)).as_matrix(), np.asarray(handle.position, dtype=np.float64))
