"""Rotation of images by quarter turns to stand upright: phones store sensor orientation, however they were held."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.ingest.readers.images import colour_pixels
from r2c2r_core.ingest.readers.protocol import Colour, RawDepth, RawFrame, Recording
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of image rotation."""

    clear: float = param(
        0.5, "share", "Minimum component of up in the image plane for a frame to vote (none when looking straight down)"
    )
    least_share: float = param(0.6, "share", "Minimum fraction of the voting frames that must agree")


def upright(recording: Recording) -> Recording:
    """The recording with colour, depth, cameras and poses rotated by the turn most frames need; unchanged if that is none."""
    turns = needed_turns(recording.frames, recording.up_capture)
    if turns == 0 or any(needed_turns(recording.frames, up) != turns for up in recording.other_ups):
        return recording  # upright, or it is not known yet which of its readings the scan supports
    told = f"images were turned by {(90, 180, -90)[turns - 1]}° counter-clockwise to stand upright"
    original = {frame.index: frame for frame in recording.frames}

    def colour_of(frame: RawFrame) -> Colour:
        pixels = colour_pixels(recording.colour_of(original[frame.index]), frame.rgb_name)
        return np.ascontiguousarray(np.rot90(pixels, turns))

    def depth_of(frame: RawFrame) -> RawDepth:
        metres, confidence, damage = recording.depth_of(original[frame.index])
        turned = None if confidence is None else np.ascontiguousarray(np.rot90(confidence, turns))
        return RawDepth(np.ascontiguousarray(np.rot90(metres, turns)), turned, damage)

    return replace(
        recording,
        frames=tuple(_turned(frame, turns) for frame in recording.frames),
        colour_of=colour_of,
        depth_of=depth_of,
        notices=(*recording.notices, told),
    )


def needed_turns(frames: tuple[RawFrame, ...], up_capture: Vector3 | None) -> int:
    """Quarter turns counter-clockwise, 0..3, that make most frames stand upright; 0 where gravity is not known."""
    params = tuned(Params)
    poses = [frame.capture_from_camera for frame in frames if frame.capture_from_camera is not None]
    if up_capture is None or not poses:
        return 0
    ups = np.array([pose.rotation.T @ up_capture for pose in poses])[:, :2]
    clear = ups[np.linalg.norm(ups, axis=1) > params.clear]
    # In the image, y points down: up along (0, -1) needs no turn, along (1, 0) one, along (0, 1) two, along (-1, 0) three
    votes = Counter(np.argmax(clear @ np.array([[0, -1], [1, 0], [0, 1], [-1, 0]]).T, axis=1).tolist())
    turns, count = votes.most_common(1)[0] if votes else (0, 0)
    return turns if count >= params.least_share * len(clear) else 0


def _turned(frame: RawFrame, turns: int) -> RawFrame:
    pose, turn = frame.capture_from_camera, np.rint(rotation_about_z(turns * np.pi / 2))
    return replace(
        frame,
        rgb_camera=_turned_camera(frame.rgb_camera, turns),
        depth_camera=_turned_camera(frame.depth_camera, turns),
        capture_from_camera=None if pose is None else Rigid3(pose.rotation @ turn, pose.translation),
    )


def _turned_camera(camera: Intrinsics, turns: int) -> Intrinsics:
    for _ in range(turns):
        camera = Intrinsics(
            fx=camera.fy,
            fy=camera.fx,
            cx=camera.cy,
            cy=camera.width - camera.cx,
            width=camera.height,
            height=camera.width,
        )
    return camera
