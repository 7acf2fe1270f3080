"""Photo crops at the resolution that outline extraction needs, so that a close-up costs no more than a distant view."""

from dataclasses import dataclass, replace

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of crops."""

    longest_px: int = param(
        320,
        "px",
        "Maximum side of a crop for outline extraction; larger crops are shrunk, and only the border uses the full resolution",
        source="a handle 1200 px wide then takes as long as one of 320 px; VGA crops are not shrunk",
        ge=32,
    )


def shrunk(camera: Intrinsics, area: tuple[slice, slice]) -> Intrinsics:
    """Camera of a photo area, downscaled to the resolution that outline extraction needs."""
    rows, columns = area
    width, height = columns.stop - columns.start, rows.stop - rows.start
    part = replace(camera, cx=camera.cx - columns.start, cy=camera.cy - rows.start, width=width, height=height)
    shrink = max(1.0, max(width, height) / tuned(Params).longest_px)
    return part if shrink == 1.0 else part.resized(max(round(width / shrink), 4), max(round(height / shrink), 4))
