"""The most probable guillotine partition of a panel that several objects were clicked on, each with a part of its own."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.runs.xy_cut import Line, LineField, across, halves
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How far partitions are searched, and what is no seam."""

    lines: int = param(
        12, "count", "of lines, likeliest first, over the objects clicked on a part, that are tried through it", ge=1
    )
    two_names: float = param(
        3.0, "log", "by which two clicks of different names make a seam between them likelier", source="one in twenty is a slip"
    )


class Partition(NamedTuple):
    """Of one panel; the more objects are told apart, then the likelier its seams, the better."""

    cuts: int
    total: float  # log-likelihood of its seams
    parts: tuple[Cell, ...]


def parted(field: LineField, cell: Cell, clicked: Sequence[np.ndarray]) -> Partition:
    """The partition of a panel by where each object was `clicked` on it, (n, 2) grid cells an object.

    A seam is straight and as long as the part that it cuts, and parts no clicks of one object; what was cut first decides how
    far the next goes, so the likeliest seam alone need not be one of the likeliest partition. Objects between which no seam
    is at all likely share a part.
    """
    whole, params = Partition(0, 0.0, (cell,)), tuned(Params)
    if len(clicked) < 2:
        return whole
    lines = sorted(_lines(field, cell, clicked), key=lambda found: -found[0].total)
    return max([whole, *(_cut(field, cell, *found) for found in lines[: max(1, params.lines // len(clicked))])], key=_value)


def _cut(field: LineField, cell: Cell, line: Line, before: Sequence[np.ndarray], after: Sequence[np.ndarray]) -> Partition:
    first, second = (parted(field, half, on) for half, on in zip(halves(cell, line), (before, after), strict=True))
    return Partition(1 + first.cuts + second.cuts, line.total + first.total + second.total, first.parts + second.parts)


def _value(partition: Partition) -> tuple[int, float]:
    return partition.cuts, partition.total


def _lines(
    field: LineField, cell: Cell, clicked: Sequence[np.ndarray]
) -> Iterator[tuple[Line, Sequence[np.ndarray], Sequence[np.ndarray]]]:
    """The likeliest seam between each two neighbours along either axis, with the objects before and after it."""
    for axis in (0, 1):
        (low, high), ordered = across(cell, axis), sorted(clicked, key=lambda on: float(on[:, axis].min()))
        for count in range(1, len(ordered)):
            start = max(float(on[:, axis].max()) for on in ordered[:count])
            stop = float(ordered[count][:, axis].min())
            line = field.best_between(cell, axis, start, stop, sized=True) if start < stop else None
            if line is not None and line.odds > -tuned(Params).two_names and low + STEP <= line.position <= high - STEP:
                yield line, ordered[:count], ordered[count:]
