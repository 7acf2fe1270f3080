"""Binary masks: packing and overlap."""

import zlib
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Mask


@dataclass(frozen=True, slots=True, kw_only=True)
class PackedMask:
    """A mask as zlib-compressed bits of its bounding box; about 3 kB for a 960x720 frame."""

    height: int
    width: int
    left: int
    top: int
    box_width: int
    box_height: int
    bits: bytes
    area_px: int


def box_around(mask: Mask, margin_px: int = 0) -> tuple[slice, slice]:
    """Rows and columns of the bounding box of a mask (h, w), with a margin inside the image; empty for an empty mask."""
    if not mask.any():
        return slice(0, 0), slice(0, 0)
    (top, bottom), (left, right) = (np.flatnonzero(mask.any(axis=axis))[[0, -1]].tolist() for axis in (1, 0))
    return slice(max(top - margin_px, 0), bottom + margin_px + 1), slice(max(left - margin_px, 0), right + margin_px + 1)


def pack_mask(mask: Mask) -> PackedMask:
    """Pack a boolean mask (h, w)."""
    height, width = mask.shape
    rows, columns = box_around(mask)
    box = mask[rows, columns]
    if not box.size:
        return PackedMask(height=height, width=width, left=0, top=0, box_width=0, box_height=0, bits=b"", area_px=0)
    return PackedMask(
        height=height,
        width=width,
        left=columns.start,
        top=rows.start,
        box_width=box.shape[1],
        box_height=box.shape[0],
        bits=zlib.compress(np.packbits(box).tobytes(), 1),
        area_px=int(box.sum()),
    )


def unpack_mask(packed: PackedMask) -> Mask:
    """The boolean mask (h, w) of a packed one."""
    mask = np.zeros((packed.height, packed.width), dtype=bool)
    if packed.box_width:
        count = packed.box_width * packed.box_height
        bits = np.unpackbits(np.frombuffer(zlib.decompress(packed.bits), dtype=np.uint8), count=count)
        mask[packed.top : packed.top + packed.box_height, packed.left : packed.left + packed.box_width] = bits.reshape(
            packed.box_height, packed.box_width
        ).astype(bool)
    return mask


def mask_iou(a: Mask, b: Mask) -> float:
    """Intersection over union; two empty masks agree (1.0)."""
    union = np.count_nonzero(a | b)
    return float(np.count_nonzero(a & b) / union) if union else 1.0
