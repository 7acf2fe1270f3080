"""View selection for an object (paper 4.2): the best frame of each interval of the recording, spread over viewing angles.

The paper takes the best frame of 20 intervals. Intervals alone repeat a view where the person lingers (method.md row 14), so
the best frames of the intervals are candidates, and each further one is the best that also adds a new direction.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of view selection."""

    intervals: int = param(
        20,
        "count",
        "Number of intervals of the recording, each of which contributes its best frame",
        source="the paper's 20 (4.2), and at least two for every requested view",
        ge=1,
    )
    border_px: int = param(2, "px", "Distance to the image's border below which a mask counts as cropped")
    full_turn_rad: float = param(
        1.0, "rad", "Angle between two viewing directions above which both views are fully independent", gt=0
    )
    same_place: float = param(
        0.02, "ratio", "Gain of a view from the direction of another one, relative to one at a fully independent angle"
    )
    stands_out_m: float = param(
        0.06, "m", "Protrusion in front of a front above which it is more than a handle", source="handles protrude up to 5 cm"
    )
    stands_out_share: float = param(
        0.2, "share", "Minimum fraction of the mask's points that protrude by stands_out_m for an open front"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MaskView:
    """Data for scoring one frame's view of an object."""

    frame_index: int
    mask: PackedMask
    sharpness: float  # only its order means something
    confidence: float  # 0..1
    from_object: Vector3  # to the camera, in the world


def choose_views(views: list[MaskView], count: int) -> list[MaskView]:
    """Up to `count` views by greedy selection: the best one, then always the best that adds a new direction."""
    params = tuned(Params)
    seen = sorted((view for view in views if view.mask.area_px > 0), key=lambda view: view.frame_index)
    if not seen:
        return []
    score = view_scores(seen)
    winners = _interval_winners(score, max(params.intervals, 2 * count))
    towards = np.array([seen[k].from_object for k in winners])
    towards = towards / np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)
    worth = score[winners]
    taken = [int(np.argmax(worth))]
    gap = np.full(len(winners), np.inf)
    while len(taken) < min(count, len(winners)):
        gap = np.minimum(gap, np.arccos(np.clip(towards @ towards[taken[-1]], -1.0, 1.0)))
        gain = worth * (params.same_place + np.minimum(gap, params.full_turn_rad))
        gain[taken] = -1.0
        taken.append(int(np.argmax(gain)))
    return [seen[winners[k]] for k in taken]


def view_scores(views: list[MaskView]) -> np.ndarray:
    """Relative score of each view of the object, 0..1: large, complete, central, sharp, confident."""
    area = np.array([view.mask.area_px for view in views], dtype=np.float64)
    sharpness = np.array([view.sharpness for view in views])
    sharp = np.searchsorted(np.sort(sharpness), sharpness) / max(len(views) - 1, 1)  # rank: ties get equal values
    whole = np.array([0.4 if is_cropped(view.mask) else 1.0 for view in views])
    central = np.array([1 - 0.3 * _off_centre(view.mask) for view in views])
    trusted = 0.25 + 0.75 * np.array([view.confidence for view in views])
    return np.asarray(np.sqrt(area / area.max()) * (0.45 + 0.55 * sharp) * whole * central * trusted)


def is_cropped(mask: PackedMask) -> bool:
    """Whether the mask touches the image border."""
    params = tuned(Params)
    right, bottom = mask.left + mask.box_width, mask.top + mask.box_height
    beyond = mask.left < params.border_px or mask.top < params.border_px
    return beyond or right > mask.width - params.border_px or bottom > mask.height - params.border_px


def stands_open(outward_m: np.ndarray) -> bool:
    """Whether points of a front, given their distance in front of its measured plane, show it open.

    Only protruding points count: seen from the side, a box shows points behind its front.
    """
    params = tuned(Params)
    return bool(len(outward_m) and np.quantile(outward_m, 1 - params.stands_out_share) > params.stands_out_m)


def _interval_winners(score: np.ndarray, intervals: int) -> np.ndarray:
    """Index of the best view of each interval; the earliest in a tie."""
    edges = np.linspace(0, len(score), min(intervals, len(score)) + 1).round().astype(int)
    return np.array([low + int(np.argmax(score[low:high])) for low, high in pairwise(edges)])


def _off_centre(mask: PackedMask) -> float:
    """Distance of the mask's centre from the image's, relative to half the image, at most 1."""
    x = (mask.left + mask.box_width / 2) / (mask.width / 2) - 1
    y = (mask.top + mask.box_height / 2) / (mask.height / 2) - 1
    return min(1.0, float(np.hypot(x, y)))
