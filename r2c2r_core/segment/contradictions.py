"""Consistency checks of the objects' masks, clicks, sizes and places: a second's work before minutes of computing.

Masks show visible pixels only, so each pixel belongs to one object: two objects that share many claim the same surface.
Each finding names the clicks and the correction; nothing is changed here.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.failing import apart
from r2c2r_core.geometry.masks import PackedMask, unpack_mask
from r2c2r_core.kitchen.category import Category, Size
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.kitchen.walls import distances_behind
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.contradiction import Contradiction
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.segment.certainty import front_certainty, unexpected_seam
from r2c2r_core.tuning import param, tuned

_SIDES = ("left", "right", "upper", "lower")


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the consistency checks."""

    frames: int = param(
        12,
        "count",
        "Maximum number of frames, spread over those that show both objects, in which their masks are compared",
        ge=1,
    )
    overlap: float = param(
        0.1,
        "share",
        "Maximum fraction of the smaller mask that two objects may share",
        source="neighbours share at most 0.02 of the sample kitchens' correct masks",
    )
    same: float = param(0.5, "share", "Minimum shared fraction of the smaller mask for two objects to be the same")
    near_click: float = param(
        0.01,
        "share",
        "Maximum distance of a click on a mask from it, as a fraction of the image's width",
        source="imprecision of fingers and borders",
    )
    unlikely: float = param(
        0.37,
        "score",
        "Size fit, 0 to 1, below which a size is implausible for its category",
        source="a tenth beyond the range of products sold",
    )
    floor_m: float = param(
        0.15,
        "m",
        "Maximum apparent height above the floor of an object that stands on it",
        source="0.03 m is the maximum on the sample kitchens",
    )
    unsure_edge: float = param(0.3, "share", "Probability of an edge below which it is questioned", ge=0, le=1)
    unsure_seam: float = param(
        0.25,
        "share",
        "Probability of a seam inside a front above which it is questioned",
        ge=0,
        le=1,
        source="six sample kitchens: 53 single fronts are at 0.15 or less, 29 pairs taken for one front at 0.9 or more",
    )
    unsure_front: float = param(
        0.6,
        "share",
        "Probability that a front is right, below which it is questioned",
        ge=0,
        le=1,
        source="below it are 48 of 64 wrong and 18 of 254 right faces of 24 kitchens, each held out",
    )
    in_wall_m: float = param(
        0.04,
        "m",
        "Maximum distance from a wall's plane of a front in that plane",
        source="the shallowest wall unit sold is 0.2 m deep",
    )


def find_contradictions(
    tracks: Mapping[str, MaskTrack], prompts: Sequence[ObjectPrompt], walls: Sequence[Wall]
) -> tuple[Contradiction, ...]:
    """All contradictions, those between two objects first; objects without a track are left out.

    A check that fails for one object or pair is logged, and the others still run.
    """
    params = tuned(Params)
    known = [prompt for prompt in prompts if prompt.name in tracks]
    found: list[Contradiction] = []
    for first, second in combinations(known, 2):
        with apart("contradictions", f"{first.name} and {second.name}", {}):
            found += _between(tracks, first, second, params)
    for prompt in known:
        with apart("contradictions", prompt.name, {}):
            found += _disobeyed(tracks[prompt.name], prompt, params)
            found += find_implausible(replace(tracks[prompt.name], category=prompt.category), walls)
    return tuple(found)


def find_implausible(track: MaskTrack, walls: Sequence[Wall]) -> tuple[Contradiction, ...]:
    """Contradictions of one object's size, place and edges with its category; its masks are not considered."""
    params, category = tuned(Params), category_of(track.category)
    sizes, place = _unlikely_sizes(track, category, params), _misplaced(track, category, walls, params)
    return (*sizes, *place, *_unsure_edges(track, category, params))


def _between(
    tracks: Mapping[str, MaskTrack], first: ObjectPrompt, second: ObjectPrompt, params: Params
) -> Iterator[Contradiction]:
    pair = tracks[first.name], tracks[second.name]
    share, frame = _overlap(*pair, params.frames)
    if share < params.overlap:
        return
    where = f"{_clicks(first)} and {_clicks(second)}"
    if share >= params.same:
        yield Contradiction(
            rule="same-thing",
            objects=(first.name, second.name),
            message=f"{where} are on the same object: {100 * share:.0f} % of the smaller mask is in both (frame {frame})",
            mend="delete one, or click off each of them on the other",
        )
    else:
        yield Contradiction(
            rule="masks-overlap",
            objects=(first.name, second.name),
            message=f"{where} claim the same surface: {100 * share:.0f} % of the smaller mask is in both (frame {frame})",
            mend=f"click off one of them where the other is, in frame {frame}",
        )


def _overlap(first: MaskTrack, second: MaskTrack, most: int) -> tuple[float, int]:
    """Fraction of the smaller mask that is in both, over frames that see both, and the frame with the largest overlap.

    Frames in which a front is open are left out: they show the surface behind it.
    """
    shared = sorted((set(first.masks) & set(second.masks)) - first.opened_frames - second.opened_frames)
    frames = [shared[i] for i in np.unique(np.linspace(0, len(shared) - 1, most).round().astype(int))] if shared else []
    both = [_shared_px(first.masks[frame], second.masks[frame]) for frame in frames]
    smaller = sum(min(first.masks[frame].area_px, second.masks[frame].area_px) for frame in frames)
    return (sum(both) / smaller, frames[int(np.argmax(both))]) if smaller else (0.0, -1)


def _shared_px(a: PackedMask, b: PackedMask) -> int:
    """Number of pixels in both masks; masks with disjoint boxes are not unpacked."""
    apart_x = a.left >= b.left + b.box_width or b.left >= a.left + a.box_width
    apart_y = a.top >= b.top + b.box_height or b.top >= a.top + a.box_height
    return 0 if apart_x or apart_y else int(np.count_nonzero(unpack_mask(a) & unpack_mask(b)))


def _disobeyed(track: MaskTrack, prompt: ObjectPrompt, params: Params) -> Iterator[Contradiction]:
    """Positive clicks outside the object's mask, and negative clicks inside it."""
    corrected = {frame.frame for frame in prompt.frames}  # a person corrected the object's visibility there
    for point in prompt.points:
        packed = track.masks.get(point.frame)
        if packed is None and (point.label == 0 or point.frame in corrected):
            continue
        if packed is None:
            said, mend = "is on it, but it is not visible in that frame", "delete it, or click where it has depth"
        elif point.label == 1 and not _near(unpack_mask(packed), point, params.near_click * packed.width):
            said, mend = "is on it, but outside its mask", "delete the click, or click nearer to its middle"
        elif point.label == 0 and _within(unpack_mask(packed), point):
            said, mend = "is off it, but inside its mask", "add a second click off it there"
        else:
            continue
        yield Contradiction(
            rule="click-disobeyed", objects=(prompt.name,), message=f"{prompt.name}: the click {_at(point)} {said}", mend=mend
        )


def _near(mask: Mask, point: PromptPoint, reach_px: float) -> bool:
    rows, columns = np.nonzero(mask)
    return bool(len(rows)) and float(np.hypot(columns + 0.5 - point.x, rows + 0.5 - point.y).min()) <= reach_px


def _within(mask: Mask, point: PromptPoint) -> bool:
    return bool(mask[int(point.y), int(point.x)])


def _unlikely_sizes(track: MaskTrack, category: Category, params: Params) -> Iterator[Contradiction]:
    """Measured sizes implausible for the category; depths are left out, because they are seldom observed.

    Tall doors are called cabinets too.
    """
    highest_m = 0.0
    if track.front is not None:
        sizes = {"wide": (track.front.width_m, category.width), "high": (track.front.height_m, category.height)}
        if category.opens in ("side", "pair"):
            highest_m = category_of("tall_cabinet").height.high
    elif track.box is not None:
        width, depth, height = track.box.dimensions_m
        sizes = {"wide": (max(width, depth), category.width), "high": (height, category.height)}
    else:
        return
    if category.name == "object":  # a name missing from the table
        return
    for word, (size_m, usual) in sizes.items():
        if usual.fit(float(size_m)) >= params.unlikely or (word == "high" and usual.high < size_m <= highest_m):
            continue
        yield Contradiction(
            rule="size-unlikely",
            objects=(track.name,),
            message=f"{track.name} is {size_m:.2f} m {word}, {_range(usual)} is usual for '{category.label}'",
            mend=_size_mend(float(size_m) > usual.high, category),
        )


def _size_mend(too_large: bool, category: Category) -> str:
    if too_large and category.kind == "front":
        return "if it is several objects, click each separately; else correct its category"
    if too_large:
        return "click off it where its mask is too large; else correct its category"
    return "click on it where its mask is too small; else correct its category"


def _misplaced(track: MaskTrack, category: Category, walls: Sequence[Wall], params: Params) -> Iterator[Contradiction]:
    """Floor-standing objects in the air, and fronts in the plane of a wall."""
    if category.on_floor and track.box is not None and track.box.support_z_m > params.floor_m:
        yield Contradiction(
            rule="in-the-air",
            objects=(track.name,),
            message=f"{track.name} stands {track.box.support_z_m:.2f} m above the floor, a '{category.label}' stands on it",
            mend="click on its lower part too; else correct its category",
        )
    if track.front is None or category.opens in ("fixed", "rigid"):
        return
    behind = distances_behind(walls, track.front.centre, track.front.outward)
    if any(abs(distance) < params.in_wall_m for distance in behind):
        yield Contradiction(
            rule="in-a-wall",
            objects=(track.name,),
            message=f"{track.name} lies in the plane of a wall, where no '{category.label}' has room behind its front",
            mend="delete it if it is the bare wall; set its depth if it is built into the wall",
        )


def _unsure_edges(track: MaskTrack, category: Category, params: Params) -> Iterator[Contradiction]:
    """Fronts that may end elsewhere: faint edges, rivals beside them, and seams inside fronts that should have none."""
    front = track.front
    if front is None or not front.edges:
        return
    sure, seam = front_certainty(front, category), unexpected_seam(front, category)
    if sure >= params.unsure_front:
        return
    faint = [k for k, odds in enumerate(front.edges) if odds < params.unsure_edge]
    seen, hidden = [k for k in faint if front.changes[k] > 0], [k for k in faint if front.changes[k] == 0]
    doubts = [
        f"its {' and '.join(_SIDES[k] for k in edges)} edge{'s' * (len(edges) > 1)} {verb}"
        for edges, verb in ((seen, "can hardly be seen"), (hidden, "can be seen in no frame"))
        if edges
    ]
    if seam > params.unsure_seam:
        doubts.append(f"there may be a seam inside it ({100 * seam:.0f} %)")
    yield Contradiction(
        rule="edge-unsure",
        objects=(track.name,),
        message=f"{track.name} is {100 * front.width_m:.0f} x {100 * front.height_m:.0f} cm if its edges are right "
        f"({100 * sure:.0f} %){': ' * bool(doubts)}{', and '.join(doubts)}",
        mend="click beside it, off it, to move an edge there; or draw it in the elevation",
    )


def _range(size: Size) -> str:
    return f"{size.low:.2f} to {size.high:.2f} m"


def _clicks(prompt: ObjectPrompt) -> str:
    """Name of the object and its first click."""
    first = next((point for point in prompt.points if point.label == 1), None)
    return f"{prompt.name} ({f'clicked {_at(first)}' if first is not None else 'drawn'})"


def _at(point: PromptPoint) -> str:
    return f"at ({point.x:.0f}, {point.y:.0f}) in frame {point.frame}"
