"""Probability of a sliding door (Bayes' rule): an equally high panel continues beside it, one track behind.

The rival is a hinged door beside a blind panel, which is set back by the door's own thickness.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.calibration import probability
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.mosaics.edges import as_lab
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.tuning import param, tuned

_GUESS = "a guess, stated as one"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters (priors and likelihoods) of sliding and hinged doors."""

    prior: float = param(
        0.03, "share", "Prior probability that a door of unspecified opening slides", gt=0, lt=1, source=_GUESS
    )
    beside: float = param(
        22.0, "ratio", "Likelihood ratio of such a panel beside a sliding leaf to one beside a hinged door", source=_GUESS
    )
    back_m: tuple[float, float] = param(
        (0.015, 0.06), "m", "Minimum and maximum distance from a leaf back to the next track", source="boards of 16-22 mm"
    )
    overlay_m: float = param(
        0.02, "m", "Usual distance from a hinged door back to a blind panel", source="boards of 16-22 mm on buffers"
    )
    overlay_sigma_m: float = param(0.004, "m", "Standard deviation of that distance, with depth error", gt=0)
    odd: float = param(0.2, "share", "Fraction of blind panels that are set back by any other distance", gt=0, lt=1)
    pull_away: float = param(
        0.9, "share", "Fraction of sliding leaves with the pull at the edge away from the panel", gt=0, lt=1
    )
    same_colour: tuple[float, float] = param(
        (0.9, 0.3), "share", "Fraction of panels in the front's colour, beside sliding leaves and beside hinged doors"
    )
    colour: float = param(12.0, "grey", "Maximum CIELAB distance between equal colours: shading differs")
    wide: float = param(
        0.6, "share", "Width of the strip beside the door that the panel must cover, as a fraction of the door's"
    )
    covers: float = param(0.6, "share", "Minimum fraction of that strip in which depth observed the panel")
    level_m: float = param(0.03, "m", "Maximum difference between their upper and lower edges")
    parallel: float = param(float(np.cos(np.radians(8.0))), "cosine", "Minimum cosine between the two planes' normals")


def sliding_chance(front: Front, planes: Sequence[PlaneRegion]) -> float:
    """Probability that a front slides sideways over the panel beside it; 0 where nothing is set back there."""
    odds = max((_odds(front, sign, plane) for plane in planes for sign in (-1, 1)), default=-np.inf)
    return probability(odds)


def _odds(front: Front, sign: int, plane: PlaneRegion) -> float:
    """Log-odds (natural) of sliding over a plane on the left (-1) or right of the front."""
    params, grid = tuned(Params), front.run.grid
    back_m = float((front.outline.centre - plane.world_from_plane.translation) @ grid.outward)
    parallel = float(plane.outward @ grid.outward) > params.parallel
    if not parallel or not params.back_m[0] < back_m < params.back_m[1] or not _goes_on(front, sign, plane):
        return -np.inf
    spread = params.overlay_sigma_m
    overlay = np.exp(-0.5 * ((back_m - params.overlay_m) / spread) ** 2) / (spread * np.sqrt(2 * np.pi))
    anywhere = 1 / (params.back_m[1] - params.back_m[0])
    odds = np.log(params.prior / (1 - params.prior)) + np.log(params.beside)
    odds -= np.log((1 - params.odd) * overlay / anywhere + params.odd)
    return float(odds + _by_pull(front, sign) + _by_colour(front, sign))


def _goes_on(front: Front, sign: int, plane: PlaneRegion) -> bool:
    """Whether depth observed the plane beside the front, over its height and no higher or lower."""
    params, cell_m = tuned(Params), front.run.grid.cell_m
    strip, slack = _beside(front, sign), params.level_m / cell_m
    above = Cell(strip.left, strip.top - 3 * slack, strip.right, strip.top - slack)
    below = Cell(strip.left, strip.bottom + slack, strip.right, strip.bottom + 3 * slack)
    inside, over, under = (_seen_share(front, part, plane) for part in (strip, above, below))
    return inside > params.covers and max(over, under) < 1 - params.covers


def _seen_share(front: Front, part: Cell, plane: PlaneRegion) -> float:
    """Fraction of a rectangle (cells of the front's grid) behind which depth observed a plane."""
    columns, rows = np.meshgrid(np.linspace(part.left, part.right, 12), np.linspace(part.top, part.bottom, 12))
    points = front.run.grid.points_at(np.stack([columns.ravel(), rows.ravel()], axis=1))
    return float(plane.supports(points, 0.0).mean())


def _beside(front: Front, sign: int) -> Cell:
    """Strip beside the front, equally high, that a panel must cover."""
    cell, wide = front.cell, tuned(Params).wide * front.cell.width
    if sign > 0:
        return Cell(cell.right, cell.top, cell.right + wide, cell.bottom)
    return Cell(cell.left - wide, cell.top, cell.left, cell.bottom)


def _by_pull(front: Front, sign: int) -> float:
    """Log-likelihood ratio by the handle's position; hinged doors have it on either side equally often."""
    if front.handle is None:
        return 0.0
    middle = (front.cell.left + front.cell.right) / 2
    is_away = sign * ((front.handle.left + front.handle.right) / 2 - middle) < 0
    away = tuned(Params).pull_away
    return float(np.log((away if is_away else 1 - away) / 0.5))


def _by_colour(front: Front, sign: int) -> float:
    """Log-likelihood ratio by whether the panel has the front's colour; 0 where no photograph shows it."""
    params = tuned(Params)
    lab, seen = as_lab(front.run.mosaic)
    here, there = (_colour(lab, seen, part) for part in (front.cell, _beside(front, sign)))
    if here is None or there is None:
        return 0.0
    leaf, hinged = params.same_colour
    if np.linalg.norm(here - there) < params.colour:
        return float(np.log(leaf / hinged))
    return float(np.log((1 - leaf) / (1 - hinged)))


def _colour(lab: np.ndarray, seen: np.ndarray, part: Cell) -> np.ndarray | None:
    rows = slice(max(round(part.top), 0), max(round(part.bottom), 0))
    columns = slice(max(round(part.left), 0), max(round(part.right), 0))
    pixels = lab[rows, columns][seen[rows, columns]]
    return np.median(pixels, axis=0) if len(pixels) > 100 else None
