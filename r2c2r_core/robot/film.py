"""A short film of the gripper at one joint or object, and its contact sheet."""

import io
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Vector3
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.robot.rig import Rig
from r2c2r_core.robot.view import Poses, Surfaces, aimed, look, poses_now

FRAME_S = 0.3  # simulated time between two pictures
SIZE = (208, 156)
_FIELD_RAD = 0.9
_COLOURS = 64
_SHEET = 8  # pictures of the sheet
_UP = np.array([0.0, 0.0, 1.0])
_TURNS = np.deg2rad([37.0, -37.0, 0.0, 75.0, -75.0])  # of the camera to the left of the front's normal


@dataclass(slots=True, kw_only=True)
class Film:
    """Recorded moments of a running simulation, rendered on demand."""

    surfaces: Surfaces
    model: Any
    camera: Intrinsics
    camera_from_world: Rigid3
    moments: list[Poses] = field(default_factory=list)
    _next_s: float = 0.0

    def watch(self, rig: Rig) -> None:
        """Record the current poses when the next frame is due."""
        if rig.data.time + 1e-9 >= self._next_s:
            self.moments.append(poses_now(rig.data))
            self._next_s = rig.data.time + FRAME_S

    def gif(self) -> bytes:
        """All moments as a GIF in real time."""
        from PIL import Image as Pictures

        drawn = [Pictures.fromarray(self._picture(moment)) for moment in self.moments]
        frames = [picture.quantize(_COLOURS, dither=Pictures.Dither.NONE) for picture in drawn]
        file = io.BytesIO()
        frames[0].save(
            file, "GIF", save_all=True, append_images=frames[1:], duration=round(1000 * FRAME_S), loop=0, optimize=True
        )
        return file.getvalue()

    def sheet(self) -> Image:
        """Contact sheet: a few moments in two rows."""
        at = np.linspace(0, len(self.moments) - 1, _SHEET).round().astype(int)
        chosen = [self._picture(self.moments[number]) for number in at]
        rows = [np.concatenate(chosen[start : start + _SHEET // 2], axis=1) for start in (0, _SHEET // 2)]
        return np.concatenate(rows, axis=0)

    def sheet_jpg(self) -> bytes:
        """The contact sheet as JPEG bytes."""
        return cv2.imencode(".jpg", self.sheet()[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes()

    def _picture(self, moment: Poses) -> Image:
        return look(self.surfaces, self.model, moment, self.camera, self.camera_from_world).rgb


def film_of(surfaces: Surfaces, rig: Rig, target: Vector3, outward: Vector3, reach_m: float) -> Film:
    """A film of `target`, which faces `outward` (level, unit), with `reach_m` around it in view.

    Seen from the left in front, or the next of a few directions from which nothing in the rig's scene hides the target.
    """
    distance_m = reach_m / np.tan(_FIELD_RAD / 2)
    views = [target + distance_m * (rotation_about_z(turn) @ outward * 1.25 + 0.45 * _UP) for turn in _TURNS]
    eye = next((view for view in views if _sees(rig, view, target)), views[0])
    camera, camera_from_world = aimed(eye, target + 0.3 * reach_m * outward, SIZE, _FIELD_RAD)
    return Film(surfaces=surfaces, model=rig.model, camera=camera, camera_from_world=camera_from_world)


def _sees(rig: Rig, eye: Vector3, target: Vector3) -> bool:
    """Whether nothing lies between an eye and the surroundings of a target."""
    import mujoco

    reach_m = float(np.linalg.norm(target - eye))
    hit_m = mujoco.mj_ray(rig.model, rig.data, eye, (target - eye) / reach_m, None, 1, -1, np.zeros(1, np.int32), None)
    return not 0.0 <= hit_m < 0.85 * reach_m
