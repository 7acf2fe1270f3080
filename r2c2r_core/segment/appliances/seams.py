"""Seams between an appliance's doors and a drawer below: level lines of its run across its front."""

from dataclasses import dataclass

from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of drawer seams."""

    share: tuple[float, float] = param(
        (0.15, 0.6),
        "share",
        "Minimum and maximum fraction of a front's height that a drawer below takes",
        source="makers: freezer drawers of 0.4-0.8 m",
    )
    same_m: float = param(0.02, "m", "Maximum distance between lines that are one seam")


def drawer_seams(front: Front) -> tuple[float, ...]:
    """Heights of the seams above the front's centre (m), the likeliest first."""
    params = tuned(Params)
    run, cell = front.run, front.cell
    cell_m = run.grid.cell_m
    low, high = (cell.bottom - share * cell.height for share in params.share)
    rows = {edge for one in run.cells if one.left < cell.right and one.right > cell.left for edge in (one.top, one.bottom)}
    rated = sorted(
        (row for row in rows if high < row < low), key=lambda row: -float(run.odds.along(1, row, cell.left, cell.right).mean())
    )
    kept: list[float] = []
    for row in rated:
        if all(abs(row - other) * cell_m > params.same_m for other in kept):
            kept.append(row)
    return tuple(((cell.top + cell.bottom) / 2 - row) * cell_m for row in kept)
