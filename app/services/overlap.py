"""IoU of two sets of masks over the frames of a recording, counted within bounding boxes."""

from collections import Counter
from collections.abc import Hashable, Iterable
from typing import Any, NamedTuple

import numpy as np

from app.jobs.mask_wire import bits_mask
from r2c2r_core.arrays import Mask

Bits = dict[str, Any]  # schemas.MaskBits


class Pair(NamedTuple):
    """A pair of overlapping objects, one of each set."""

    first: Hashable
    second: Hashable
    iou: float  # over all frames
    frames: int  # in which both have a mask


class Overlaps:
    """Accumulated pixel counts, updated per frame."""

    def __init__(self) -> None:
        self._shared: Counter[tuple[Hashable, Hashable]] = Counter()
        self._together: Counter[tuple[Hashable, Hashable]] = Counter()
        self._areas: tuple[Counter[Hashable], Counter[Hashable]] = (Counter(), Counter())

    def add(self, first: dict[Hashable, Bits], second: dict[Hashable, Bits]) -> None:
        """Add the masks of one frame, by object."""
        boxes = [{key: _Box.of(bits) for key, bits in side.items()} for side in (first, second)]
        for areas, side in zip(self._areas, boxes, strict=True):
            areas.update({key: box.area for key, box in side.items()})
        for one, a in boxes[0].items():
            for other, b in boxes[1].items():
                self._together[one, other] += 1
                if shared := a.shared(b):
                    self._shared[one, other] += shared

    def matched(self, least: float) -> list[Pair]:
        """Greedy one-to-one matching by descending IoU, down to `least`."""
        pairs = [self._pair(one, other) for one, other in self._shared]
        taken: tuple[set[Hashable], set[Hashable]] = (set(), set())
        found = []
        for pair in sorted(pairs, key=lambda pair: (-pair.iou, str(pair.first), str(pair.second))):
            if pair.iou >= least and pair.first not in taken[0] and pair.second not in taken[1]:
                found.append(pair)
                taken[0].add(pair.first)
                taken[1].add(pair.second)
        return found

    def _pair(self, one: Hashable, other: Hashable) -> Pair:
        shared = self._shared[one, other]
        either = self._areas[0][one] + self._areas[1][other] - shared
        return Pair(one, other, shared / either, self._together[one, other])


def spread(frames: Iterable[int], most: int) -> list[int]:
    """At most `most` of the frames, evenly spread."""
    ordered = sorted(frames)
    if len(ordered) <= most:
        return ordered
    return [ordered[k] for k in np.linspace(0, len(ordered) - 1, most).round().astype(int)]


class _Box(NamedTuple):
    """A mask with its bounding box."""

    left: int
    top: int
    mask: Mask

    @classmethod
    def of(cls, bits: Bits) -> "_Box":
        inner = bits | {"left": 0, "top": 0, "width": bits["box_width"], "height": bits["box_height"]}
        return cls(bits["left"], bits["top"], bits_mask(inner))

    @property
    def area(self) -> int:
        return int(np.count_nonzero(self.mask))

    def shared(self, other: "_Box") -> int:
        """Number of pixels in both masks."""
        left, top = max(self.left, other.left), max(self.top, other.top)
        mine = self.mask[top - self.top :, left - self.left :]
        theirs = other.mask[top - other.top :, left - other.left :]
        height, width = min(mine.shape[0], theirs.shape[0]), min(mine.shape[1], theirs.shape[1])
        return int(np.count_nonzero(mine[:height, :width] & theirs[:height, :width]))
