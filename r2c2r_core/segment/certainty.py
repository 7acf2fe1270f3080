"""Logistic model of the probability that a front is right, from its faintest edge and an uncut seam."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.calibration import log_odds, probability
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.tuning import param, tuned

_FITTED = "fitted on 318 faces in 24 kitchens of five makers: benchmarks/front_certainty.py"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters (weights) of the logistic model."""

    faintest: float = param(0.718, "ratio", "Weight of the log-odds of the faintest edge", source=_FITTED)
    seam: float = param(
        3.942, "ratio", "Weight of the logarithm of the probability that no unexpected seam is inside", source=_FITTED
    )
    offset: float = param(-0.387, "log", "Constant term of the log-odds", source=_FITTED)


def front_certainty(front: FrontPanel, category: Category) -> float:
    """Probability that each edge is within 10 mm, or 2.5 % of that side, of its true place; 1 for a drawn front."""
    params = tuned(Params)
    weights = np.array([params.faintest, params.seam, params.offset])
    return probability(float(evidence(front, category) @ weights)) if front.edges else 1.0


def evidence(front: FrontPanel, category: Category) -> np.ndarray:
    """Features (3,) in the order of the model's weights; the last one is 1."""
    shown = 3 if category.stands else 4  # the lower edge of what stands on the floor lies in shadow
    return np.array(
        [
            log_odds(min(front.edges[:shown])),
            np.log(1 - min(unexpected_seam(front, category), 0.999)),
            1.0,
        ]
    )


def unexpected_seam(front: FrontPanel, category: Category) -> float:
    """Probability of an uncut seam; 0 where seams are expected."""
    return 0.0 if expects_seams(category, front.width_m) else front.seam


def expects_seams(category: Category, width_m: float) -> bool:
    """Whether seams across a front are expected: two doors, a stack, or an appliance's window, keypad or drawer."""
    pair = category.opens == "pair" or (category.wider is not None and width_m >= category.wider[0])
    return pair or category.one_front or category.several_fronts or category.kind == "appliance"
