"""Regressions as defined by the accuracy guard (`benchmarks/guard.py`)."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
Kitchens = dict[str, Any]


@pytest.fixture
def regressions(monkeypatch: pytest.MonkeyPatch) -> Callable[[Kitchens, Kitchens], list[str]]:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from guard import regressions  # type: ignore[import-not-found]

    found: Callable[[Kitchens, Kitchens], list[str]] = regressions
    return found


def kitchen(certified: bool | None = True, **objects: dict[str, float] | None) -> Kitchens:
    return {"k": {"certified": certified, "objects": objects}}


DOOR = {"width_error": 1.0, "joint_type": 1.0, "mask_iou": 0.95}


def test_a_metric_regresses_only_beyond_its_tolerance(regressions: Any) -> None:
    within = DOOR | {"width_error": 1.4, "mask_iou": 0.94}
    better = DOOR | {"width_error": 0.1, "mask_iou": 0.99}
    assert regressions(kitchen(a=within), kitchen(a=DOOR)) == []
    assert regressions(kitchen(a=better), kitchen(a=DOOR)) == []
    assert regressions(kitchen(a=DOOR | {"width_error": 1.6}), kitchen(a=DOOR)) == ["k/a: width_error 1.6, was 1"]
    assert regressions(kitchen(a=DOOR | {"mask_iou": 0.9}), kitchen(a=DOOR)) == ["k/a: mask_iou 0.9, was 0.95"]
    assert regressions(kitchen(a=DOOR | {"joint_type": 0.0}), kitchen(a=DOOR)) == ["k/a: joint_type 0, was 1"]


def test_a_newly_missing_object_is_a_regression(regressions: Any) -> None:
    assert regressions(kitchen(a=None), kitchen(a=DOOR)) == ["k/a: missing"]
    assert regressions(kitchen(), kitchen(a=DOOR)) == ["k/a: missing"]
    assert regressions(kitchen(a=None), kitchen(a=None)) == []
    assert regressions(kitchen(a=DOOR), kitchen(a=None)) == []


def test_a_lost_certificate_is_a_regression_unless_not_requested(regressions: Any) -> None:
    assert regressions(kitchen(False, a=DOOR), kitchen(True, a=DOOR)) == ["k: no certificate"]
    assert regressions(kitchen(None, a=DOOR), kitchen(True, a=DOOR)) == []
    assert regressions(kitchen(False, a=DOOR), kitchen(False, a=DOOR)) == []


def test_a_small_loss_on_most_objects_is_a_regression(regressions: Any) -> None:
    names = [f"door_{k}" for k in range(12)]
    before = kitchen(**dict.fromkeys(names, DOOR))
    worse = {name: DOOR | {"width_error": 1.1} for name in names}
    assert regressions(kitchen(**worse), before) == ["width_error: worse on 12 objects, better on 0"]
    mixed = worse | {name: DOOR | {"width_error": 0.9} for name in names[:6]}
    assert regressions(kitchen(**mixed), before) == []


def test_kitchens_and_metrics_on_one_side_only_are_not_compared(regressions: Any) -> None:
    assert regressions(kitchen(a=DOOR), {}) == []
    assert regressions(kitchen(a={"joint_type": 1.0}), kitchen(a=DOOR)) == []
