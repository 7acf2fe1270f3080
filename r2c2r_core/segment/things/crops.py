"""Crops of photos at a size that an outline needs: a close-up takes no longer than a view from afar."""

from dataclasses import dataclass, replace

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How large a crop is."""

    longest_px: int = param(
        320,
        "px",
        "of the crop an outline is looked for in: a larger one is shrunk, and only its border drawn at the photo's resolution",
        source="a handle 1200 px wide takes the time of one of 320 px; VGA crops are not shrunk",
        ge=32,
    )


def shrunk(camera: Intrinsics, area: tuple[slice, slice]) -> Intrinsics:
    """The camera of an area of a photo, no larger than an outline needs."""
    rows, columns = area
    width, height = columns.stop - columns.start, rows.stop - rows.start
    part = replace(camera, cx=camera.cx - columns.start, cy=camera.cy - rows.start, width=width, height=height)
    shrink = max(1.0, max(width, height) / tuned(Params).longest_px)
    return part if shrink == 1.0 else part.resized(max(round(width / shrink), 4), max(round(height / shrink), 4))
