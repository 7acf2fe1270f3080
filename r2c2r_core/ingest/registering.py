"""Registration of depth to the colour images with the calibration fitted by the capture doctor; only on request.

Frame and Capture have one pose and treat depth as seen from the colour camera. For a recording with a separate depth camera,
the colour camera gets the fitted focal length and principal point, poses move to its centre, and each depth image is
reprojected into it.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from r2c2r_core.geometry.camera import reproject_depth
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.doctor.registration import WIDTH, Registration, measure_registration
from r2c2r_core.ingest.store import write_depth
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.progress import SILENT, Progress

_MEASURED = 30  # frames, as the doctor takes


class Registered(NamedTuple):
    """The registered frames, and a notice about them."""

    frames: tuple[Frame, ...]
    notice: str


def register_depth(
    frames: Sequence[Frame], images: FrameImages, store: Path, rng: np.random.Generator, progress: Progress = SILENT
) -> Registered:
    """Reproject the stored depth if the fit is clearly better than the calibration; otherwise change nothing, with a notice."""
    spread = frames[:: -(-len(frames) // _MEASURED)]
    found = measure_registration(spread, images, rng)
    if found is None:
        return Registered(tuple(frames), "depth was not registered to the colour images: it has too few edges for a fit")
    if not found.wrong:
        return Registered(
            tuple(frames), f"depth was not changed: it is registered to the colour images within {found.off_px:.1f} px of 640"
        )
    registered = []
    for position, frame in enumerate(frames):
        progress.at(position / len(frames), f"registering depth {position + 1}/{len(frames)}")
        changed = as_colour_sees(frame, found)
        shift_m = frame.world_from_camera.inverse.apply(changed.world_from_camera.translation)
        write_depth(
            store,
            frame.index,
            reproject_depth(images.depth(frame.index).metres, frame.depth_camera, changed.depth_camera, shift_m),
        )
        registered.append(changed)
    right_mm, down_mm = -found.shift_mm[0], -found.shift_mm[1]
    notice = (
        f"depth was registered to the colour images; it was {found.off_px:.0f} px of 640 off: "
        f"the colour camera has {found.focal_factor:.3f} x the focal length and lies {abs(right_mm):.0f} mm "
        f"{'right' if right_mm > 0 else 'left'} of the depth camera, "
        f"{abs(down_mm):.0f} mm {'below' if down_mm > 0 else 'above'}"
    )
    return Registered(tuple(registered), notice)


def as_colour_sees(frame: Frame, found: Registration) -> Frame:
    """The frame posed at the fitted colour camera, with the same camera at depth resolution as its depth camera."""
    rgb, depth = frame.rgb_camera, frame.depth_camera
    by = max(rgb.width, rgb.height) / WIDTH  # the fit's pixels are those of an image 640 wide
    camera = replace(
        rgb,
        fx=rgb.fx * found.focal_factor,
        fy=rgb.fy * found.focal_factor,
        cx=rgb.cx + found.shift_px[0] * by,
        cy=rgb.cy + found.shift_px[1] * by,
    )
    # A point x of the depth camera is x + shift of the colour camera's, whose centre is at -shift
    centre_m = -np.array([*found.shift_mm, 0.0]) / 1000.0
    return replace(
        frame,
        rgb_camera=camera,
        depth_camera=camera.resized(depth.width, depth.height),
        world_from_camera=frame.world_from_camera @ Rigid3(np.eye(3), centre_m),
    )
