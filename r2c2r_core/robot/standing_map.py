"""SVG floor plan of base positions, coloured by the number of joints within reach."""

from collections import defaultdict
from html import escape
from textwrap import wrap
from typing import Any

import numpy as np

from r2c2r_core.robot.arm import Stand
from r2c2r_core.robot.standing import GRID_M, Floor, Reach

_PX_PER_M = 160.0
_AROUND_M = 0.3
_LINE_PX = 18
_LEAST_PX = 520
_WRAPPED = 68  # characters of a line
_FROM, _TO = np.array([219.0, 234.0, 247.0]), np.array([8.0, 81.0, 156.0])  # one joint, all joints: ColorBrewer's Blues


def standing_svg(floor: Floor, reached: dict[str, dict[Stand, Reach]], places: dict[Stand, tuple[str, ...]]) -> str:
    """Map with furniture in grey, positions coloured by number of joints served, chosen ones numbered and listed below."""
    served = _served(reached)
    low, high = _bounds(floor, list(served))
    width, height = (high - low) * _PX_PER_M
    most = max(served.values(), default=1)
    listed = _listed(places, reached)
    metres = f"translate({-low[0] * _PX_PER_M:.1f} {high[1] * _PX_PER_M:.1f}) scale({_PX_PER_M:.0f} {-_PX_PER_M:.0f})"
    total_px = height + _LINE_PX * (len(listed) + 2.5)
    words = f"{len(reached)} joints; the best base position reaches {max(served.values(), default=0)}"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {max(width, _LEAST_PX):.0f} {total_px:.0f}" role="img" '
        f'font-family="sans-serif" font-size="13"><title>Base positions of the arm</title><desc>{words}</desc>',
        '<rect width="100%" height="100%" fill="#fff"/>',
        f'<g transform="{metres}">',
        *(_outline(polygon) for polygon in getattr(floor.furniture, "geoms", [floor.furniture])),
        *(_cell(x, y, count, most) for (x, y), count in sorted(served.items())),
        "</g>",
        *(_place(number, stand, low, high) for number, stand in enumerate(places, 1)),
        *_legend(height, most),
        *(
            f'<text x="10" y="{height + _LINE_PX * (row + 2.2):.0f}" fill="#1c1c1c">{escape(line)}</text>'
            for row, line in enumerate(listed)
        ),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _served(reached: dict[str, dict[Stand, Reach]]) -> dict[tuple[float, float], int]:
    """Number of joints served by each position, at any lift."""
    found: dict[tuple[float, float], set[str]] = defaultdict(set)
    for joint, stands in reached.items():
        for stand in stands:
            found[stand.x_m, stand.y_m].add(joint)
    return {place: len(joints) for place, joints in found.items()}


def _bounds(floor: Floor, places: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    corners = [] if floor.furniture.is_empty else [floor.furniture.bounds[:2], floor.furniture.bounds[2:]]
    points = np.array([*corners, *places, *(() if corners or places else ((0.0, 0.0),))])
    return points.min(axis=0) - _AROUND_M, points.max(axis=0) + _AROUND_M


def _outline(polygon: Any) -> str:
    if polygon.geom_type != "Polygon":
        return ""
    corners = " ".join(f"{x:.3f},{y:.3f}" for x, y in polygon.exterior.coords)
    return f'<polygon points="{corners}" fill="#d5d5d2" stroke="#8a8a86" stroke-width="0.008"/>'


def _cell(x: float, y: float, count: int, most: int) -> str:
    half = GRID_M / 2
    return f'<rect x="{x - half:.3f}" y="{y - half:.3f}" width="{GRID_M}" height="{GRID_M}" fill="{_colour(count, most)}"/>'


def _place(number: int, stand: Stand, low: np.ndarray, high: np.ndarray) -> str:
    """A numbered disc with the arm's direction."""
    x, y = (stand.x_m - low[0]) * _PX_PER_M, (high[1] - stand.y_m) * _PX_PER_M
    tip_x, tip_y = x + 26 * np.cos(stand.yaw_rad), y - 26 * np.sin(stand.yaw_rad)
    return (
        f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{tip_x:.1f}" y2="{tip_y:.1f}" stroke="#b3400f" stroke-width="3"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="11" fill="#fff" stroke="#b3400f" stroke-width="2"/>'
        f'<text x="{x:.1f}" y="{y + 4.5:.1f}" text-anchor="middle" font-weight="700" fill="#b3400f">{number}</text>'
    )


def _legend(top: float, most: int) -> list[str]:
    parts = [f'<text x="10" y="{top + 14:.0f}" fill="#1c1c1c">joints within reach:</text>']
    for count in range(1, most + 1):
        x = 130 + 34 * (count - 1)
        parts.append(f'<rect x="{x}" y="{top + 3:.0f}" width="14" height="14" fill="{_colour(count, most)}" stroke="#8a8a86"/>')
        parts.append(f'<text x="{x + 18}" y="{top + 14:.0f}" fill="#1c1c1c">{count}</text>')
    return parts


def _listed(places: dict[Stand, tuple[str, ...]], reached: dict[str, dict[Stand, Reach]]) -> list[str]:
    lines = [
        f"{number}: x {stand.x_m:.1f}, y {stand.y_m:.1f} m, lifted {stand.lift_m:.1f} m: {', '.join(joints)}"
        for number, (stand, joints) in enumerate(places.items(), 1)
    ]
    missed = [joint for joint, stands in reached.items() if not stands]
    lines += [f"out of reach: {', '.join(missed)}"] if missed else []
    return [row for line in lines for row in wrap(line, _WRAPPED, subsequent_indent="   ")]


def _colour(count: int, most: int) -> str:
    share = (count - 1) / max(most - 1, 1)
    return "#" + "".join(f"{round(value):02x}" for value in _FROM + share * (_TO - _FROM))
