"""Which frames show an object well: the paper's interval choice (section 4.2), on plain figures of its masks."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class MaskView:
    """What is needed to judge one frame's view of an object."""

    frame_index: int
    area_px: int
    left: int  # bounding box in pixels
    top: int
    box_width: int
    box_height: int
    width: int  # image size
    height: int
    sharpness: float
    confidence: float = 1.0


def choose_views(views: list[MaskView], count: int = 20, *, border_px: int = 2) -> list[int]:
    """Frame numbers in recording order: the views are split into `count` intervals, each gives its best.

    Best means large, uncropped, near the image centre and sharp. A cropped view stands in only where an interval
    offers no whole one and fewer than a quarter of the intervals do.
    """
    ordered = sorted((view for view in views if view.area_px > 0), key=lambda view: view.frame_index)
    if not ordered:
        return []
    count = min(count, len(ordered))
    largest = max(view.area_px for view in ordered)
    sharpest = max(max(view.sharpness for view in ordered), 1e-9)
    chosen: list[MaskView] = []
    for i in range(count):
        interval = ordered[i * len(ordered) // count : (i + 1) * len(ordered) // count]
        chosen.append(max(interval, key=lambda view: (view_score(view, largest, sharpest, border_px), -view.frame_index)))
    whole = [view for view in chosen if not is_cropped(view, border_px)]
    kept = whole if len(whole) >= max(1, count // 4) else chosen
    return [view.frame_index for view in kept]


def view_score(view: MaskView, largest_px: int, sharpest: float, border_px: int = 2) -> float:
    """How well a frame shows the object, 0..1."""
    off_x = abs(view.left + view.box_width / 2 - view.width / 2) / (view.width / 2)
    off_y = abs(view.top + view.box_height / 2 - view.height / 2) / (view.height / 2)
    centred = 1 - 0.5 * min(1.0, (off_x**2 + off_y**2) ** 0.5)
    sharp = 0.5 + 0.5 * min(1.0, view.sharpness / sharpest) ** 0.5
    whole = 0.3 if is_cropped(view, border_px) else 1.0
    return float((view.area_px / largest_px) ** 0.5 * centred * sharp * whole * max(view.confidence, 0.05))


def is_cropped(view: MaskView, border_px: int = 2) -> bool:
    """Whether the mask touches the image border."""
    return (
        view.left < border_px
        or view.top < border_px
        or view.left + view.box_width > view.width - border_px
        or view.top + view.box_height > view.height - border_px
    )
