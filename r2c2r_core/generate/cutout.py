"""What an image-to-3D model is shown: the object alone, as RGBA with the mask in alpha."""

import cv2
import numpy as np
from jaxtyping import UInt8

from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.evidence import View

RGBA = UInt8[np.ndarray, "_ _ 4"]

LONGEST_PX = 1024  # TRELLIS and SAM 3D look at 518 px; twice that leaves them the choice of filter
_LEAST_PX = 24  # side of the mask; TRELLIS crops to a box of whole pixels and fails on an empty one
_BORDER_PX = 4


def rgba_cutout(view: View, longest_px: int = LONGEST_PX) -> RGBA:
    """The view's crop with its mask in alpha, at most `longest_px` wide or high; raises GenerationFailed without a usable mask.

    Some alpha is always 0: TRELLIS takes an image without transparency for one whose background it must remove itself.
    """
    rows, columns = np.flatnonzero(view.mask.any(axis=1)), np.flatnonzero(view.mask.any(axis=0))
    if min(len(rows), len(columns)) < _LEAST_PX:
        raise GenerationFailed(
            f"frame {view.frame_index}: the mask is {len(columns)} x {len(rows)} px, {_LEAST_PX} needed on each side",
            hint="add a click on a frame that shows the object larger",
        )
    rgba = np.dstack([view.rgb, view.mask.astype(np.uint8) * 255])
    if view.mask.all():
        rgba = cv2.copyMakeBorder(rgba, *(_BORDER_PX,) * 4, cv2.BORDER_CONSTANT, value=(0, 0, 0, 0))
    scale = longest_px / max(rgba.shape[:2])
    if scale < 1:
        size = (max(round(rgba.shape[1] * scale), 1), max(round(rgba.shape[0] * scale), 1))
        rgba = cv2.resize(rgba, size, interpolation=cv2.INTER_AREA)
        rgba[..., 3] = np.where(rgba[..., 3] > 127, 255, 0)
    return np.asarray(rgba, dtype=np.uint8)


def usable_views(views: tuple[View, ...]) -> tuple[View, ...]:
    """The views whose mask is large enough for `rgba_cutout`."""
    return tuple(v for v in views if min(v.mask.any(axis=1).sum(), v.mask.any(axis=0).sum()) >= _LEAST_PX)


def png_of(rgba: RGBA) -> bytes:
    """The picture as PNG."""
    done, png = cv2.imencode(".png", cv2.cvtColor(rgba, cv2.COLOR_RGBA2BGRA))
    assert done, "encoding a uint8 array cannot fail"
    return png.tobytes()
