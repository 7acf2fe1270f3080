"""Camera of the 3D view: filming side or axis views, with a normal or a long lens."""

import threading
from collections import deque
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from r2c2r_core.arrays import Points, Vector3

Axis = Literal["front", "back", "left", "right", "top", "bottom"]
AXES: tuple[Axis, ...] = get_args(Axis)
USUAL_FOV = np.radians(75.0)  # viser's field of view, upright
LONG_FOV = np.radians(3.0)  # viser has no orthographic camera: a long lens is nearly orthographic
_REMEMBERED = 32  # camera moves that may occur while a page opens
_UNDRAWN: Vector3 = np.array(
    [-5.0, 0.0, 0.0]
)  # three.js's default camera position, reported by a slow page before it has drawn anything
_NEAR_M = {
    USUAL_FOV: 0.01,
    LONG_FOV: 2.0,
}  # the long lens is some 80 m away, where a near plane at 1 cm gives a depth resolution of 0.1 m


@dataclass(slots=True)
class Lens:
    """The camera shared by all pages of one view."""

    server: Any
    fov: float = USUAL_FOV
    _left: deque[Vector3] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))  # earlier positions
    _turning: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self.server.on_client_connect(self.meet)

    def meet(self, client: Any) -> None:
        """Move the camera of a page that connected with an outdated position, as viser moves only connected pages.

        Such a page is recognised by its position: an earlier one, or the default before drawing. A position set by the user
        and restored after a lost connection is neither.
        """
        with self._turning:
            place = np.asarray(client.camera.position)
            if any(np.allclose(place, earlier, atol=1e-3) for earlier in (_UNDRAWN, *self._left)):
                first = self.server.initial_camera
                _turn(client.camera, tuple(first.position), tuple(first.look_at), self.fov)

    def look(self, position: Vector3, target: Vector3) -> None:
        """Set the position for the usual lens; the long lens steps back along the same line."""
        away = np.asarray(position) - target
        step_back = np.tan(USUAL_FOV / 2) / np.tan(self.fov / 2)
        self.stand(target + step_back * away, target)

    def stand(self, position: Vector3, target: Vector3, fov: float | None = None) -> None:
        """Set the exact position, with another lens until the next move if one is given."""
        place, aim = tuple(float(v) for v in position), tuple(float(v) for v in target)
        with self._turning:
            for camera in self._cameras():
                _turn(camera, place, aim, self.fov if fov is None else fov)

    @property
    def pose(self) -> tuple[list[float], list[float]]:
        """Position and target of the last connected page, or the initial ones without a page."""
        clients = list(self.server.get_clients().values())
        camera = clients[-1].camera if clients else self.server.initial_camera
        return [float(v) for v in camera.position], [float(v) for v in camera.look_at]

    def use(self, *, parallel: bool) -> None:
        """Change the lens, keeping the apparent size of the target."""
        fov = LONG_FOV if parallel else USUAL_FOV
        if fov == self.fov:
            return
        step = np.tan(self.fov / 2) / np.tan(fov / 2)
        self.fov = fov
        with self._turning:
            for camera in self._cameras():
                place, aim = np.array(camera.position), np.array(camera.look_at)
                _turn(camera, tuple(aim + step * (place - aim)), tuple(aim), fov)

    def _cameras(self) -> list[Any]:
        """All cameras to move, first the initial camera of future pages."""
        self._left.append(np.array(self.server.initial_camera.position))
        return [self.server.initial_camera, *(client.camera for client in self.server.get_clients().values())]


def _turn(camera: Any, position: tuple[float, ...], target: tuple[float, ...], fov: float) -> None:
    camera.fov, camera.near = fov, _NEAR_M.get(fov, _NEAR_M[USUAL_FOV])
    camera.position, camera.look_at = position, target


def from_axis(axis: Axis, facing: Vector3, points: Points) -> tuple[Vector3, Vector3]:
    """Position and target that show all points from one side; `facing` is the horizontal direction of the fronts."""
    ahead = np.array([facing[0], facing[1], 0.0]) / max(float(np.hypot(facing[0], facing[1])), 1e-9)
    right = np.array([-ahead[1], ahead[0], 0.0])  # to the right when facing the fronts
    up = np.array([0.0, 0.0, 1.0])
    tilt = 1e-3 * ahead  # straight down there is no up
    ways = {"front": ahead, "back": -ahead, "left": -right, "right": right, "top": up + tilt, "bottom": tilt - up}
    return from_direction(ways[axis], points)


def from_direction(towards_camera: Vector3, points: Points) -> tuple[Vector3, Vector3]:
    """Position and target whose square picture, with the usual lens, just contains all points (N, 3)."""
    back = towards_camera / np.linalg.norm(towards_camera)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= max(float(np.linalg.norm(right)), 1e-9)
    axes = np.array([right, np.cross(back, right), back])
    seen = points @ axes.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    beside, above, nearer = (seen - middle).T
    distance = (nearer + np.maximum(abs(beside), abs(above)) / np.tan(USUAL_FOV / 2)).max()
    target = middle @ axes
    return target + distance * back, target
