"""A person's corrections of single frames, which override the masks of any segmenter."""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np

from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.geometry.masks import PackedMask, pack_mask, unpack_mask
from r2c2r_core.model.inputs import FrameSaid, ObjectPrompt
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.segment.protocol import Glimpse


def as_found(prompt: ObjectPrompt) -> ObjectPrompt:
    """Prompt without single-frame corrections: they do not affect segmentation, and changing them must not rerun it."""
    return replace(prompt, frames=())


def corrected_track(track: MaskTrack, said: tuple[FrameSaid, ...]) -> MaskTrack:
    """Track with a person's corrections applied to those frames; raises ObjectNotSeen where no frame is left."""
    if not said:
        return track
    size = next(iter(track.masks.values()))
    numbers = {one.frame for one in said}
    painted = {one.frame: _at_size(one.mask, size) for one in said if one.mask is not None}
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


def _at_size(mask: PackedMask, size: PackedMask) -> PackedMask:
    """Mask resized to the frames' size."""
    if (mask.width, mask.height) == (size.width, size.height):
        return mask
    pixels = unpack_mask(mask).astype(np.uint8)
    grown = cv2.resize(pixels, (size.width, size.height), interpolation=cv2.INTER_NEAREST)
    return pack_mask(grown > 0)
