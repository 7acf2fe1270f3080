"""Scores of joint motion filmed while fronts open: unknown states count as wrong."""

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from r2c2r_core.evaluate.stage import evaluate_bundle
from tests.core.evaluate.test_stage import bundle_of, row, truth_of, write

FRAMES, OPEN, UNSEEN = 20, range(8, 18), (2, 12)  # UNSEEN: a closed and an open frame that do not show it
NAMES = ("cabinet_1", "drawer_1")


def opened_truth() -> dict[str, Any]:
    """Ground truth in which only a door and a drawer are opened."""
    truth = truth_of(0)
    for thing in truth["objects"]:
        for joint in thing["joints"]:
            opens = thing["name"] in NAMES
            widest = joint["upper"] if thing["name"] == "drawer_1" else 0.8 * joint["upper"]
            joint["states"] = [widest if opens and i in OPEN else 0.0 for i in range(FRAMES)]
            joint["seen_px"] = [100 if i in UNSEEN else 4000 for i in range(FRAMES)]
            joint["seen_share"] = [0.9] * FRAMES
            joint["largest"] = widest if opens else 0.0
            joint["inside"] = {"depth_m": 0.45, "shelves_m": []} if opens else None
    return truth


def filmed_bundle(truth: dict[str, Any]) -> dict[str, Any]:
    """Manifest of a bundle that reproduces the truth."""
    manifest = bundle_of(deepcopy(truth))
    for thing in manifest["objects"]:
        for joint in thing["joints"]:
            states = [{"frame": i, "value": v, "sigma": 0.001} for i, v in enumerate(joint.pop("states"))]
            opens = thing["name"] in NAMES
            told = {key: joint.pop(key) for key in ("largest", "inside")}
            del joint["seen_px"], joint["seen_share"]
            joint["motion"] = {"source": "measured", "covariance": None, "states": states, **told} if opens else None
            if opens:
                joint["upper"] = told["largest"]
                joint["source"]["limits"] = "measured" if thing["name"] == "drawer_1" else "at_least"
    return manifest


def found(tmp_path: Path, change: Any = lambda manifest: None) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """The metrics of the door and of the drawer."""
    truth = opened_truth()
    manifest = filmed_bundle(truth)
    change({thing["name"]: thing["joints"][0] for thing in manifest["objects"] if thing["joints"]})
    evaluation = evaluate_bundle(*write(tmp_path, truth, manifest))
    return row(evaluation, "cabinet_1"), row(evaluation, "drawer_1")


def test_a_bundle_with_the_true_motions_scores_perfectly(tmp_path: Path) -> None:
    door, drawer = found(tmp_path)
    for metrics in (door, drawer):
        assert (metrics["state"], metrics["state_open"], metrics["limit_source"]) == (1.0, 1.0, 1.0)
        assert metrics["inner_depth"] == pytest.approx(0.0)
        assert metrics["false_motion"] == 0.0


def test_unknown_and_missing_states_count_as_errors(tmp_path: Path) -> None:
    def forget(joints: dict[str, Any]) -> None:
        joints["cabinet_1"]["motion"]["states"][9]["value"] = None
        del joints["drawer_1"]["motion"]["states"][9]

    shown, ajar = FRAMES - len(UNSEEN), len(OPEN) - 1
    for metrics in found(tmp_path, forget):
        assert metrics["state"] == pytest.approx((shown - 1) / shown)
        assert metrics["state_open"] == pytest.approx((ajar - 1) / ajar)


def test_frames_that_do_not_show_the_front_are_not_scored(tmp_path: Path) -> None:
    def err(joints: dict[str, Any]) -> None:
        for i in UNSEEN:
            joints["cabinet_1"]["motion"]["states"][i]["value"] = 1.3

    assert found(tmp_path, err)[0]["state"] == 1.0


@pytest.mark.parametrize(("off", "right"), [(0.9, 1.0), (1.1, 0.0)])
def test_states_within_2_degrees_or_6_mm_count_as_correct(tmp_path: Path, off: float, right: float) -> None:
    def shift(joints: dict[str, Any]) -> None:
        for name, tolerance in (("cabinet_1", np.radians(2.0)), ("drawer_1", 0.006)):
            for each in joints[name]["motion"]["states"]:
                each["value"] += off * tolerance

    assert [metrics["state"] for metrics in found(tmp_path, shift)] == [right, right]


def test_a_wrong_joint_type_or_missing_motion_scores_zero(tmp_path: Path) -> None:
    def spoil(joints: dict[str, Any]) -> None:
        joints["cabinet_1"]["type"] = "prismatic"
        joints["drawer_1"]["motion"] = None

    door, drawer = found(tmp_path, spoil)
    assert (door["state"], door["limit_source"], drawer["state"]) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("share", "source", "right"), [(0.8, "measured", 0.0), (1.0, "measured", 1.0), (0.7, "at_least", 0.0)])
def test_a_limit_is_right_as_measured_or_at_least_as_wide_as_seen(
    tmp_path: Path, share: float, source: str, right: float
) -> None:
    """The door was opened to 0.8 of its travel."""

    def claim(joints: dict[str, Any]) -> None:
        joints["cabinet_1"]["source"]["limits"] = source
        joints["cabinet_1"]["upper"] *= share / 0.8

    assert found(tmp_path, claim)[0]["limit_source"] == right


def test_motion_of_a_static_joint_is_a_false_motion(tmp_path: Path) -> None:
    truth = opened_truth()
    manifest = filmed_bundle(truth)
    door, fridge = (next(t for t in manifest["objects"] if t["name"] == name) for name in ("cabinet_1", "refrigerator"))
    fridge["joints"][0]["motion"] = deepcopy(door["joints"][0]["motion"])
    evaluation = evaluate_bundle(*write(tmp_path, truth, manifest))
    assert row(evaluation, "refrigerator")["false_motion"] == 1.0
    assert row(evaluation, "cabinet_2")["false_motion"] == 0.0


def test_ground_truth_without_motion_gives_no_motion_scores(tmp_path: Path) -> None:
    truth = truth_of(0)
    metrics = row(evaluate_bundle(*write(tmp_path, truth, bundle_of(truth))), "cabinet_1")
    assert [metrics[name] for name in ("state", "state_open", "limit_source", "inner_depth", "false_motion")] == [None] * 5
