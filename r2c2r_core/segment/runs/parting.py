"""Most probable guillotine partition of a panel on which several objects were clicked, one part per object."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.runs.xy_cut import Line, LineField, across, halves
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the partition search."""

    lines: int = param(
        12,
        "count",
        "Maximum number of lines tried through a part, divided by the number of objects clicked on it, likeliest first",
        ge=1,
    )
    two_names: float = param(
        3.0, "log", "Log-odds gain of a seam between two clicks of different names", source="one click in twenty is a slip"
    )


class Partition(NamedTuple):
    """A partition of one panel; more separated objects are better, then likelier seams."""

    cuts: int
    total: float  # log-likelihood of its seams
    parts: tuple[Cell, ...]


def parted(field: LineField, cell: Cell, clicked: Sequence[np.ndarray]) -> Partition:
    """Best partition of a panel by where each object was `clicked`, (n, 2) grid cells per object.

    A seam is straight, spans the whole part that it cuts, and does not separate clicks of one object. Earlier cuts limit later
    ones, so the likeliest seam alone need not belong to the likeliest partition. Objects without a plausible seam between them
    share a part.
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
    """Likeliest seam between adjacent objects along either axis, with the objects before and after it."""
    for axis in (0, 1):
        (low, high), ordered = across(cell, axis), sorted(clicked, key=lambda on: float(on[:, axis].min()))
        for count in range(1, len(ordered)):
            start = max(float(on[:, axis].max()) for on in ordered[:count])
            stop = float(ordered[count][:, axis].min())
            line = field.best_between(cell, axis, start, stop, sized=True) if start < stop else None
            if line is not None and line.odds > -tuned(Params).two_names and low + STEP <= line.position <= high - STEP:
                yield line, ordered[:count], ordered[count:]
