"""The drawer that carries a thing, and the recording as seen from that drawer, in which the thing stands still."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import DepthMetres, Image
from r2c2r_core.geometry.camera import pixel_centres, pixel_rays
from r2c2r_core.model.capture import Capture, Depth, Frame, FrameImages
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.rectangle import Rectangle3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Carrier:
    """A drawer as it was filmed: its front where it is closed, and its motion."""

    front: Rectangle3
    motion: JointMotion

    def frame(self, frame: Frame) -> Frame | None:
        """Frame whose camera is moved as the drawer moves to its closed state; None where that state is unknown."""
        state = self.motion.states.get(frame.index)
        if state is None or state.value is None:
            return None
        return replace(frame, world_from_camera=self.motion.opening(state.value).inverse @ frame.world_from_camera)

    def capture(self, capture: Capture, shown: Mapping[int, object]) -> Capture:
        """Frames that show a thing in the drawer, by number in `shown`, as seen from the drawer."""
        frames = [self.frame(frame) for frame in capture.frames if frame.index in shown]
        known = {frame.index: frame for frame in frames if frame is not None}
        return replace(capture, frames=tuple(known.values()), images=_BehindFront(capture.images, self.front, known))


@dataclass(frozen=True, slots=True, eq=False)
class _BehindFront(FrameImages):
    """Images with the depth of a drawer's front where the sensor has none there: it hides what lies behind its edges."""

    images: FrameImages
    front: Rectangle3
    frames: Mapping[int, Frame]

    def rgb(self, frame_index: int) -> Image:
        """The colour image."""
        return self.images.rgb(frame_index)

    def depth(self, frame_index: int) -> Depth:
        """The depth image, completed on the drawer's front."""
        measured = self.images.depth(frame_index)
        front_m = _face_depth(self.front, self.frames[frame_index])
        metres = np.where(measured.valid, measured.metres, front_m).astype(np.float32)
        return Depth(metres, measured.valid | (front_m > 0))


def _face_depth(face: Rectangle3, frame: Frame) -> DepthMetres:
    """Depth of the outer side of a rectangle in a depth image; 0 beside it, and seen from behind."""
    front_from_camera = face.world_from_front.inverse @ frame.world_from_camera
    eye, camera = front_from_camera.translation, frame.depth_camera
    rays = front_from_camera.turn(pixel_rays(pixel_centres(camera), camera))
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = -eye[1] / rays[..., 1]
        hit = (eye[1] < 0) & (depth > 0) & face.covers(eye + depth[..., None] * rays)
    return np.where(hit, depth, 0.0).astype(np.float32)
