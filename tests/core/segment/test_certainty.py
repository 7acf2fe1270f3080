"""Probability that a front is right: lowered by a faint edge and an unexpected seam."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.segment.certainty import Params, front_certainty

FITTED = Path(__file__).parents[3] / "benchmarks" / "front_certainty.json"
CABINET, REFRIGERATOR = category_of("cabinet"), category_of("refrigerator")
CLEAR = FrontPanel(
    world_from_front=Rigid3(),
    width_m=CABINET.width.usual,
    height_m=CABINET.height.usual,
    handle=None,
    confidence=0.98,
    edges=(0.98,) * 4,
    changes=(20.0,) * 4,
    seam=0.001,
)


def test_parameters_match_the_fitted_file() -> None:
    numbers = Params()
    for name, weight in json.loads(FITTED.read_text())["weights"].items():
        assert getattr(numbers, name) == pytest.approx(weight, abs=0.005)


def test_clear_edges_give_high_certainty() -> None:
    assert front_certainty(CLEAR, CABINET) > 0.85


@pytest.mark.parametrize(
    "weak",
    [
        {"edges": (0.98, 0.98, 0.3, 0.98)},
        {"seam": 0.4},
    ],
)
def test_weak_evidence_lowers_the_certainty_of_a_front(weak: dict[str, float]) -> None:
    assert 1 - front_certainty(replace(CLEAR, **weak), CABINET) > 1.5 * (1 - front_certainty(CLEAR, CABINET))


def test_a_second_faint_edge_adds_nothing() -> None:
    """Errors of light, colour and plane are common to all edges of a front."""
    one, two = (replace(CLEAR, edges=(0.3, last, 0.98, 0.98)) for last in (0.98, 0.3))
    assert front_certainty(one, CABINET) == front_certainty(two, CABINET)


def test_the_lower_edge_counts_only_where_it_is_above_the_floor() -> None:
    faint = replace(CLEAR, edges=(0.98, 0.98, 0.98, 0.1), changes=(20.0, 20.0, 20.0, 0.0))
    assert front_certainty(faint, REFRIGERATOR) == front_certainty(CLEAR, REFRIGERATOR)
    assert front_certainty(faint, CABINET) < front_certainty(CLEAR, CABINET)


def test_seams_that_are_usual_and_sizes_lower_nothing() -> None:
    assert front_certainty(replace(CLEAR, seam=0.9), REFRIGERATOR) == front_certainty(CLEAR, REFRIGERATOR)
    for size in ({"height_m": 1.3}, {"height_m": 2.1}, {"width_m": 1.4}):
        assert front_certainty(replace(CLEAR, **size), CABINET) == front_certainty(CLEAR, CABINET)


def test_a_drawn_front_is_certain() -> None:
    assert front_certainty(replace(CLEAR, edges=(), changes=()), CABINET) == 1.0


def test_certainty_is_bounded_by_what_was_measured() -> None:
    """The least and the most certain fronts of the fitted kitchens are neither all wrong nor all right."""
    worst = replace(CLEAR, edges=(0.0,) * 4, changes=(0.0,) * 4, seam=1.0)
    best = replace(CLEAR, edges=(1.0,) * 4, changes=(100.0,) * 4, seam=0.0)
    assert 0.0 < front_certainty(worst, CABINET) < 0.05
    assert 0.9 < front_certainty(best, CABINET) < 0.995
    assert np.isfinite(front_certainty(worst, CABINET))
