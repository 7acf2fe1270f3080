"""Cached renderings of the finished scene from the recording's frames, beside the measured depth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.export.plan import Plan
from r2c2r_core.export.preview import Soup, scene_soup, soup_faces
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.model.track import MaskTrack

HIDDEN_M = 0.02  # a surface further behind the measured one is occluded by something that is not in the model
_SHARED_FRAMES = 40
_SHOWS_SHARE = 0.25  # frames with less than this fraction of the object's largest mask are skipped


class Look(NamedTuple):
    """One frame's measured depth and rendered model, per depth pixel."""

    measured_m: np.ndarray
    known: Mask
    drawn_m: np.ndarray
    bodies: np.ndarray  # number of the visible body, 0: none


@dataclass(frozen=True, slots=True, kw_only=True)
class Looks:
    """A recording's frames with the closed scene rendered into them."""

    frames: Sequence[Frame]
    shared: Sequence[Frame]  # an evenly spread subset, used first
    soup: Soup
    at: Callable[[Frame], Look]  # rendered on first use


def looks_of(capture: Capture, plan: Plan) -> Looks:
    """The recording's frames with renderings of the bundle's scene."""
    soup = scene_soup(plan, 0.0)
    at = lru_cache(maxsize=_SHARED_FRAMES)(lambda frame: _look(capture, frame, soup))
    return Looks(frames=capture.frames, shared=spread(capture.frames, _SHARED_FRAMES), soup=soup, at=at)


def showing(frames: Sequence[Frame], track: MaskTrack) -> list[Frame]:
    """The frames that show an object large and closed."""
    largest = max((mask.area_px for mask in track.masks.values()), default=0)

    def shows(frame: Frame) -> bool:
        mask = track.masks.get(frame.index)
        return mask is not None and mask.area_px > _SHOWS_SHARE * largest and frame.index not in track.opened_frames

    return [frame for frame in frames if shows(frame)]


def spread(frames: Sequence[Frame], count: int) -> list[Frame]:
    """At most `count` of the frames, evenly spread."""
    if not frames:
        return []
    return [frames[k] for k in np.unique(np.linspace(0, len(frames) - 1, count).round().astype(int))]


def _look(capture: Capture, frame: Frame, soup: Soup) -> Look:
    depth = capture.images.depth(frame.index)
    attributes = np.repeat(soup.ids[:, None], 3, axis=1)
    drawn = rasterize(soup.corners, soup_faces(soup), attributes, frame.depth_camera, frame.world_from_camera.inverse)
    return Look(
        measured_m=depth.metres,
        known=depth.valid & (depth.metres > 0),
        drawn_m=drawn.depth_m,
        bodies=np.rint(drawn.attributes[..., 0]).astype(int),
    )
