"""Most probable outline of a body of revolution from strips of all views: colour, depth and edges in one shortest path."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.segment.things.pixel_cut import ColourModel, learn_colours, unmixed
from r2c2r_core.segment.things.strips import Strips
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the profile search."""

    colour: float = param(
        0.6,
        "ratio",
        "Weight of colour log-odds for a body relative to a single pixel: a cap's colours were never learned, a shadow's were",
        source="24 bottles of two generators: at 1.0 one takes in a wall in shadow; with costlier borders one loses its cap",
    )
    one_colour: float = param(
        6.0,
        "grey",
        "Standard deviation of one surface point's colour between views, in CIELAB units a channel: noise, blur and shading",
        gt=0,
    )
    most_odds: float = param(3.0, "log", "Maximum absolute log-odds of a view's colour given the other views", gt=0)
    beside: float = param(2 / 3, "share", "Fraction of the searched radii beyond which only the background shows", gt=0, lt=1)
    border: float = param(
        12.0,
        "score",
        "Cost of a border without a colour edge, as log-odds per cell",
        source="12 bottles of a second generator: at 2.5 one takes in a wall in shadow",
    )
    edge: float = param(
        3.0,
        "ratio",
        "Colour step that halves the border cost, relative to the median step between cells, which blurred backgrounds leave",
        gt=0,
    )


class Colours(NamedTuple):
    """Colour models of the body against what lies behind it: the support, other surfaces, both."""

    support: ColourModel
    others: ColourModel
    all: ColourModel

    def odds(self, strips: Strips) -> np.ndarray:
        """Log-odds of each place, by the model of what lies behind it there."""
        return np.where(strips.on_support, self.support.odds(strips.lab), self.others.odds(strips.lab))


class Profile(NamedTuple):
    """Radius in cells at each level, and its log-odds relative to no body at all."""

    cells: np.ndarray
    score: float


def profile_evidence(strips: Strips, colours: Colours) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean over views and sides (levels, cells): log-odds of the body, colour steps inwards and to the level below."""
    params = tuned(Params)
    coloured = np.stack([unmixed(view) for view in colours.odds(strips)])
    lab = strips.lab.astype(np.float32)
    coloured = np.logaddexp(coloured, _by_other_views(lab, strips.shown)) - np.log(2)
    odds = strips.depth_odds + params.colour * coloured
    half = lab.shape[2] // 2
    across = np.pad(np.linalg.norm(np.diff(lab, axis=2), axis=3), ((0, 0), (0, 0), (0, 1)))
    across = np.concatenate([across[:, :, :half], np.roll(across, 1, axis=2)[:, :, half:]], axis=2)
    along = np.pad(np.linalg.norm(np.diff(lab, axis=1), axis=3), ((0, 0), (1, 0), (0, 0)))
    return _folded(odds, strips.shown), _folded(across, strips.shown), _folded(along, strips.shown)


def _by_other_views(lab: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Photo-consistency log-odds (views, levels, columns): one surface colour in all views against the background.

    Photo-consistency (Kutulakos and Seitz 2000): a surface at the axis has the same colour in all views and on both sides,
    whichever colour that is; the background lies at another place in each view.
    """
    params, half = tuned(Params), lab.shape[2] // 2
    mean = _folded(lab, shown)
    mean = np.concatenate([mean[:, ::-1], mean], axis=1)
    beside = np.abs(np.arange(2 * half) - half + 0.5) > params.beside * half
    at, known = lab[:, :, beside], shown[:, :, beside, None]
    count = np.maximum(known.sum(axis=(0, 2)), 1)
    behind = np.where(known, at, 0.0).sum(axis=(0, 2)) / count
    spread = np.where(known, (at - behind[:, None]) ** 2, 0.0).sum(axis=(0, 2)) / count
    own = params.one_colour**2
    other = np.maximum(spread.mean(axis=1), own)[:, None]
    on = -((lab - mean) ** 2).sum(axis=3) / (2 * own) - 1.5 * np.log(own)
    off = -((lab - behind[:, None]) ** 2).sum(axis=3) / (2 * other) - 1.5 * np.log(other)
    return np.asarray(np.clip(on - off, -params.most_odds, params.most_odds))


def _folded(values: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Mean over views and both sides of the axis, for scalars or vectors."""
    half, shown = values.shape[2] // 2, shown.reshape(shown.shape + (1,) * (values.ndim - 3))
    total, count = np.where(shown, values, 0.0).sum(axis=0), shown.sum(axis=0)
    total, count = (sides[:, half:] + sides[:, :half][:, ::-1] for sides in (total, count))
    return np.asarray(total / np.maximum(count, 1))


def best_profile(odds: np.ndarray, across: np.ndarray, along: np.ndarray) -> Profile:
    """Viterbi path of the most probable radii, in cells per level, less than all; above an empty level all are empty."""
    params = tuned(Params)
    usual = [params.edge * float(np.median(steps)) + 1e-6 for steps in (across, along)]
    side, lid = (params.border / (1 + (step / u) ** 2) for step, u in zip((across, along), usual, strict=True))
    levels = len(odds)
    inside = np.pad(np.cumsum(odds, axis=1), ((0, 0), (1, 0)))
    sides = np.column_stack([np.zeros(levels), side[:, 1:], np.full(levels, np.inf)])
    lids = np.pad(np.cumsum(lid, axis=1), ((0, 0), (1, 0)))
    value = inside - sides
    best, came = value[0], []
    for level in range(1, levels):
        change = best[None] - np.abs(lids[level][:, None] - lids[level][None])  # (to, from)
        change[1:, 0] = -np.inf
        came.append(np.argmax(change, axis=1))
        best = change.max(axis=1) + value[level]
    cells = [int(np.argmax(best))]
    for before in reversed(came):
        cells.append(int(before[cells[-1]]))
    return Profile(np.array(cells[::-1]), float(best.max()))


def learn_behind(strips: Strips, on: np.ndarray, off: np.ndarray) -> Colours:
    """Colour models of the places `on` the body against those `off` it (views, levels, columns), by what lies behind."""
    on, off = on & strips.shown, off & strips.shown
    each = [off & strips.on_support, off & ~strips.on_support, off]
    return Colours(*(learn_colours([(strips.lab, on, behind)]) for behind in each))
