"""Input image of an image-to-3D model: the object alone as RGBA, with the mask in alpha."""

from dataclasses import replace

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

    Some alpha is always 0: TRELLIS removes the background itself from an image without transparency.
    """
    rows, columns = np.flatnonzero(view.mask.any(axis=1)), np.flatnonzero(view.mask.any(axis=0))
    if min(len(rows), len(columns)) < _LEAST_PX:
        raise GenerationFailed(
            f"frame {view.frame_index}: the mask is {len(columns)} x {len(rows)} px, {_LEAST_PX} needed on each side",
            hint="add a click on a frame that shows the object larger",
        )
    small = bounded(view, longest_px)
    rgba = np.dstack([small.rgb, small.mask.astype(np.uint8) * 255])
    if small.mask.all():
        rgba = cv2.copyMakeBorder(rgba, *(_BORDER_PX,) * 4, cv2.BORDER_CONSTANT, value=(0, 0, 0, 0))
    return np.asarray(rgba, dtype=np.uint8)


def bounded(view: View, longest_px: int = LONGEST_PX) -> View:
    """The view with its colour image limited to `longest_px`; its depth keeps its own resolution."""
    height, width = view.mask.shape
    scale = longest_px / max(height, width)
    if scale >= 1:
        return view
    size = (max(round(width * scale), 1), max(round(height * scale), 1))
    mask = cv2.resize(view.mask.astype(np.uint8) * 255, size, interpolation=cv2.INTER_AREA) > 127
    rgb = np.asarray(cv2.resize(view.rgb, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return replace(view, rgb=rgb, mask=np.asarray(mask), rgb_camera=view.rgb_camera.resized(*size))


def usable_views(views: tuple[View, ...]) -> tuple[View, ...]:
    """The views whose mask is large enough for `rgba_cutout`."""
    return tuple(v for v in views if min(v.mask.any(axis=1).sum(), v.mask.any(axis=0).sum()) >= _LEAST_PX)


def png_of(rgba: RGBA) -> bytes:
    """The image as PNG bytes."""
    done, png = cv2.imencode(".png", cv2.cvtColor(rgba, cv2.COLOR_RGBA2BGRA))
    assert done, "encoding a uint8 array cannot fail"
    return png.tobytes()
