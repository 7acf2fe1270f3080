"""Plausibility checks of a recording's cameras and positions, against damaged or foreign files."""

from dataclasses import replace

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.readers.protocol import Recording

_FARTHEST_M = 1000.0  # from the recording's own origin
_FOCAL_SHARE = (0.2, 10.0)  # of the larger image side: 136 to 6 deg of view
_CENTRE_SHARE = (0.2, 0.8)  # of the image's width and height


def plausible(recording: Recording) -> Recording:
    """The recording without frames whose camera misfits its image or is a kilometre away; raises CaptureError if all do."""
    misfits = [(f.index, c) for f in recording.frames for c in (f.rgb_camera, f.depth_camera) if not _is_plausible(c)]
    odd = {index for index, _ in misfits}
    notices = [f"{len(odd)} frames have a camera that does not fit their images and were left out"] if odd else []
    if len(odd) == len(recording.frames):
        index, camera = misfits[0]
        raise CaptureError(
            f"{recording.files.source}: frame {index}: focal length {camera.fx:.0f}x{camera.fy:.0f} and centre "
            f"({camera.cx:.0f}, {camera.cy:.0f}) do not belong to {camera.width}x{camera.height} pixels",
            hint="were the images resized or cropped after the export? use the untouched recording",
        )
    near = tuple(f for f in recording.frames if f.index not in odd and _is_near(f.capture_from_camera))
    if not near:
        raise CaptureError(f"{recording.files.source}: no camera lies within a kilometre", hint="are the poses in metres?")
    if far := len(recording.frames) - len(odd) - len(near):
        notices.append(f"{far} frames are more than a kilometre away and were left out")
    return replace(recording, frames=near, notices=(*recording.notices, *notices))


def _is_near(pose: Rigid3 | None) -> bool:
    return pose is None or float(np.abs(pose.translation).max()) < _FARTHEST_M


def _is_plausible(camera: Intrinsics) -> bool:
    side = max(camera.width, camera.height)
    focal = all(_FOCAL_SHARE[0] < f / side < _FOCAL_SHARE[1] for f in (camera.fx, camera.fy))
    centre = ((camera.cx, camera.width), (camera.cy, camera.height))
    return focal and all(_CENTRE_SHARE[0] < at / size < _CENTRE_SHARE[1] for at, size in centre)
