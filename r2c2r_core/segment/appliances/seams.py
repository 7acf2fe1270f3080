"""Seams between an appliance's doors and a drawer below or a panel beside them: lines of its run across its front."""

from dataclasses import dataclass

from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the seams."""

    share: tuple[float, float] = param(
        (0.15, 0.6),
        "share",
        "Minimum and maximum fraction of a front's height that a drawer below takes",
        source="makers: freezer drawers of 0.4-0.8 m",
    )
    panel_share: tuple[float, float] = param(
        (0.1, 0.45), "share", "Minimum and maximum fraction of a front's width that a control panel beside its door takes"
    )
    same_m: float = param(0.02, "m", "Maximum distance between lines that are one seam")


def drawer_seams(front: Front) -> tuple[float, ...]:
    """Heights of the seams of a drawer below, above the front's centre (m), the likeliest first."""
    cell, (least, most) = front.cell, tuned(Params).share
    rows = {row for row in _lines(front, 1) if least < (cell.bottom - row) / cell.height < most}
    middle = (cell.top + cell.bottom) / 2
    return tuple((middle - row) * front.run.grid.cell_m for row in _likeliest(front, 1, rows))


def panel_seams(front: Front) -> tuple[float, ...]:
    """Positions of the seams beside a control panel, right of the front's centre (m), the likeliest first."""
    cell, (least, most) = front.cell, tuned(Params).panel_share
    columns = {x for x in _lines(front, 0) if least < min(x - cell.left, cell.right - x) / cell.width < most}
    middle = (cell.left + cell.right) / 2
    return tuple((column - middle) * front.run.grid.cell_m for column in _likeliest(front, 0, columns))


def _lines(front: Front, axis: int) -> set[float]:
    """Columns (axis 0) or rows (axis 1) of the run's panel borders that cross a front."""
    box = front.cell
    cells = [one for one in front.run.cells if one.left < box.right and one.right > box.left]
    cells = [one for one in cells if one.top < box.bottom and one.bottom > box.top] if axis == 0 else cells
    return {edge for one in cells for edge in ((one.left, one.right) if axis == 0 else (one.top, one.bottom))}


def _likeliest(front: Front, axis: int, lines: set[float]) -> list[float]:
    """Lines by falling log-odds along the front, the likeliest of each group of near ones."""
    ends = (front.cell.top, front.cell.bottom) if axis == 0 else (front.cell.left, front.cell.right)
    kept: list[float] = []
    for line in sorted(lines, key=lambda line: -float(front.run.odds.along(axis, line, *ends).mean())):
        if all(abs(line - other) * front.run.grid.cell_m > tuned(Params).same_m for other in kept):
            kept.append(line)
    return kept
