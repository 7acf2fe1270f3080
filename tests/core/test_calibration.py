import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.calibration import calibrated
from r2c2r_core.tuning import changed, params_of, tuning
from tests.core.segment.test_expected_iou import AT_2_M, FRAME, box, expected_iou
from tests.core.synthesize.kitchen_units import Handle, Unit
from tests.core.synthesize.test_build_scene import built

FITTED = Path(__file__).parents[2] / "benchmarks" / "calibration.json"

CLAIMS = np.linspace(0.0, 1.0, 201)


@pytest.mark.parametrize(("slope", "offset"), [(1.0, 0.0), (0.4, 1.2), (2.5, -3.0)])
def test_calibration_is_monotonic_and_maps_zero_and_one_to_themselves(slope: float, offset: float) -> None:
    worth = np.array([calibrated(claim, slope, offset) for claim in CLAIMS])
    assert (np.diff(worth) > 0).all()
    assert (worth[0], worth[-1]) == (0.0, 1.0)


def test_slope_one_and_offset_zero_leave_confidence_unchanged() -> None:
    assert calibrated(0.73, 1.0, 0.0) == pytest.approx(0.73)


def test_calibration_maps_compose_linearly_in_log_odds() -> None:
    """Applying a map twice is a different map, so a confidence must be calibrated only once."""
    twice = calibrated(calibrated(0.9, 0.5, 0.4), 0.5, 0.4)
    assert twice == pytest.approx(calibrated(0.9, 0.25, 0.6))
    assert twice != pytest.approx(calibrated(0.9, 0.5, 0.4), abs=0.01)


@pytest.mark.parametrize(("name", "module"), [("mask", "segment.expected_iou"), ("hinge", "synthesize.joints")])
def test_calibration_parameters_match_the_fitted_file(name: str, module: str) -> None:
    found, numbers = json.loads(FITTED.read_text())["maps"][name], params_of(module)()
    assert (numbers.slope, numbers.offset) == (found["slope"], found["offset"])
    assert numbers.slope > 0
    assert found["after"]["off"] < found["before"]["off"]


MAP, NONE = {"slope": 2.0, "offset": 0.5}, {"slope": 1.0, "offset": 0.0}


def test_mask_confidence_is_calibrated_exactly_once() -> None:
    def claim(numbers: Mapping[str, float]) -> float:
        with tuning(changed({"segment.expected_iou": numbers})):
            return expected_iou(box(200, 200, 260, 260), 0.9, FRAME, AT_2_M, 0.008)

    assert claim(MAP) == pytest.approx(calibrated(claim(NONE), **MAP))


def test_hinge_confidence_is_calibrated_exactly_once() -> None:
    def claim(numbers: Mapping[str, float]) -> float:
        with tuning(changed({"synthesize.joints": numbers})):
            handle = Handle(0.09, 0.2)
            found = built(Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7), handle=handle)).objects[0].joints[0].confidence
        assert found is not None
        return found

    assert claim(MAP) == pytest.approx(calibrated(claim(NONE), **MAP))
