"""A person's corrections of single frames, which override the masks of any segmenter there."""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import PackedMask, pack_mask, unpack_mask
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import FrameSaid
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.segment.protocol import Glimpse


def painted_masks(said: tuple[FrameSaid, ...], capture: Capture) -> dict[int, Mask]:
    """Masks that a person painted, at the size of their frames, by frame."""
    return {one.frame: _resized(one.mask, capture.frame(one.frame).rgb_camera) for one in said if one.mask is not None}


def corrected_track(track: MaskTrack, said: tuple[FrameSaid, ...]) -> MaskTrack:
    """Track with a person's corrections applied to those frames; raises ObjectNotSeen where no frame is left."""
    if not said:
        return track
    size = next(iter(track.masks.values()))
    numbers = {one.frame for one in said}
    painted = {one.frame: pack_mask(_resized(one.mask, size)) for one in said if one.mask is not None}
    masks = {frame: mask for frame, mask in track.masks.items() if frame not in numbers} | painted
    if not masks:
        raise ObjectNotSeen(
            f"{track.name}: marked as visible in 0 frames, expected at least 1", hint="undo one of the corrections"
        )
    return replace(
        track,
        masks=dict(sorted(masks.items())),
        confidence={frame: 1.0 if frame in painted else track.confidence[frame] for frame in sorted(masks)},
        motions=tuple(
            replace(motion, states={frame: state for frame, state in motion.states.items() if frame not in numbers})
            for motion in track.motions
        ),
    )


def corrected_stream(found: Iterator[Glimpse], said: tuple[FrameSaid, ...]) -> Iterator[Glimpse]:
    """Corrected masks as a stream, the painted frames first."""
    numbers = {one.frame for one in said}
    for one in said:
        if one.mask is not None:
            yield one.frame, one.mask, 1.0
    for glimpse in found:
        if glimpse[0] not in numbers:
            yield glimpse


def _resized(mask: PackedMask, size: PackedMask | Intrinsics) -> Mask:
    pixels = unpack_mask(mask).astype(np.uint8)
    return cv2.resize(pixels, (size.width, size.height), interpolation=cv2.INTER_NEAREST) > 0
