"""API encoding of masks: the bits of the mask's bounding box at preview size."""

import base64
from typing import Any

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.geometry.masks import PackedMask, pack_mask, unpack_mask


def mask_bits(packed: PackedMask, preview_width: int) -> dict[str, Any]:
    """The mask as schemas.MaskBits, at most `preview_width` pixels wide."""
    small = packed if packed.width <= preview_width else _shrunk(packed, preview_width)
    return {
        "width": small.width,
        "height": small.height,
        "left": small.left,
        "top": small.top,
        "box_width": small.box_width,
        "box_height": small.box_height,
        "bits": base64.b64encode(small.bits).decode(),
    }


def bits_mask(bits: dict[str, Any]) -> Mask:
    """The boolean mask, at preview size, of schemas.MaskBits."""
    shape = {key: bits[key] for key in ("width", "height", "left", "top", "box_width", "box_height")}
    return unpack_mask(PackedMask(**shape, bits=base64.b64decode(bits["bits"]), area_px=0))


def _shrunk(packed: PackedMask, width: int) -> PackedMask:
    height = max(round(packed.height * width / packed.width), 1)
    full = unpack_mask(packed).astype(np.uint8) * 255
    return pack_mask(cv2.resize(full, (width, height), interpolation=cv2.INTER_AREA) >= 128)
