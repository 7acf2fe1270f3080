"""Masks of tables and worktops without the clicked objects that stand on them: thin ones differ from the top only in colour."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from r2c2r_core.geometry.masks import pack_mask, unpack_mask
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.track import MaskTrack

_ON_SLAB_M = 0.05  # maximum distance of an underside from the slab under it (scans bend by 3 cm)


def stands_on(thing: MaskTrack, slab: MaskTrack) -> bool:
    """Whether a thing stands on a table or a worktop."""
    if thing.kind != "thing" or thing.box is None or slab.box is None:
        return False
    if not category_of(slab.category).flat_top or category_of(thing.category).flat_top:  # one worktop under two names
        return False
    height, place = slab.box.dimensions_m[2] / 2, slab.box.world_from_object
    local = place.inverse.apply(thing.box.world_from_object.translation)
    over = bool((np.abs(local[:2]) < slab.box.dimensions_m[:2] / 2).all())
    return over and abs(thing.box.support_z_m - float(place.translation[2] + height)) < _ON_SLAB_M


def without_things(slab: MaskTrack, things: Sequence[MaskTrack]) -> MaskTrack:
    """The slab's masks less those of the things on it, in the frames that still show it; as they are where none does."""
    masks = {}
    for frame, mask in slab.masks.items():
        own = unpack_mask(mask)
        for thing in things:
            if frame in thing.masks:
                own &= ~unpack_mask(thing.masks[frame])
        if own.any():
            masks[frame] = pack_mask(own)
    return replace(slab, masks=masks, confidence={frame: slab.confidence[frame] for frame in masks}) if masks else slab
