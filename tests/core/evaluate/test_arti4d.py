"""Evaluation against the axes of Arti4D, with a tiny sequence in its own layout."""

import json
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.cli import main
from r2c2r_core.errors import BundleError
from r2c2r_core.evaluate.arti4d import evaluate_arti4d
from r2c2r_core.evaluate.stage import Evaluation
from r2c2r_core.geometry.transforms import Rigid3
from tests.core.evaluate.test_stage import WORLD_FROM_CAPTURE, bundle_of, truth_of
from tests.core.ingest.tiny import TinyRoom
from tests.core.ingest.tiny_formats import write_arti4d

TILT = np.radians(2.0)


def sequence_of(folder: Path, truth: dict, *, moved_m: float = 0.0) -> Path:
    """A sequence whose truth has the door and the drawer of a kitchen, the door's axis off by two degrees."""
    sequence = write_arti4d(folder / "scene_1", TinyRoom(count=3))
    joints = {thing["name"]: thing["joint"] for thing in truth["objects"]}
    door, drawer = joints["cabinet_1"], joints["drawer_1"]
    axis = np.array(door["axis"])
    aside = np.cross(axis, [0.3, 0.5, 0.8])
    aside /= np.linalg.norm(aside)
    tilted = np.cos(TILT) * axis + np.sin(TILT) * aside
    axes = {
        "kitchen_door": {"position": (np.array(door["origin"]) + moved_m * aside).tolist(), "axis": (-3.0 * tilted).tolist()},
        "top_drawer": {"position": drawer["origin"], "axis": drawer["axis"]},
        "never_built": {"position": [40.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0]},
    }
    (sequence / "scene_1.json").write_text(json.dumps(axes))
    return sequence


def bundle_in(folder: Path, truth: dict) -> Path:
    bundle = folder / "bundle"
    bundle.mkdir()
    (bundle / "manifest.json").write_text(json.dumps(bundle_of(truth)))
    return bundle


def values(evaluation: Evaluation, name: str) -> dict[str, float | None]:
    return {metric.name: metric.value for row in evaluation.rows if row.name == name for metric in row.metrics}


def test_axes_are_matched_by_position_and_scored_in_world_coordinates(tmp_path: Path) -> None:
    truth = truth_of(0)
    assert not np.allclose(WORLD_FROM_CAPTURE.matrix, Rigid3().matrix)
    evaluation = evaluate_arti4d(bundle_in(tmp_path, truth), sequence_of(tmp_path, truth))
    matched = {row.name: row.matched for row in evaluation.rows}
    assert matched == {"kitchen_door": "cabinet_1", "top_drawer": "drawer_1", "never_built": None}
    door, drawer = values(evaluation, "kitchen_door"), values(evaluation, "top_drawer")
    assert door["axis"] == pytest.approx(2.0, abs=1e-6)
    assert door["pivot"] == pytest.approx(0.0, abs=1e-6)
    assert (drawer["axis"], drawer["pivot"]) == (pytest.approx(0.0, abs=1e-5), None)
    assert {metric.name: metric.value for metric in evaluation.scene}["objects_found"] == pytest.approx(2 / 3)


def test_a_shifted_pivot_has_the_error_of_its_offset(tmp_path: Path) -> None:
    truth = truth_of(0)
    door = values(evaluate_arti4d(bundle_in(tmp_path, truth), sequence_of(tmp_path, truth, moved_m=0.02)), "kitchen_door")
    assert door["pivot_arti4d"] == pytest.approx(0.02 * np.cos(TILT), abs=1e-6)
    assert door["pivot"] == pytest.approx(20.0, abs=0.1)


def test_the_command_prints_the_table_and_reports_missing_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = truth_of(0)
    bundle, sequence = bundle_in(tmp_path, truth), sequence_of(tmp_path, truth)
    assert main(["evaluate", str(bundle), "--benchmark", "arti4d", str(sequence)]) == 0
    assert "kitchen_door" in capsys.readouterr().out
    (sequence / "scene_1.json").unlink()
    with pytest.raises(BundleError, match=r"scene_1\.json: no such file"):
        evaluate_arti4d(bundle, sequence)
    assert main(["evaluate", str(bundle), "--benchmark", "nobody", str(sequence)]) != 0
    assert "choose arti4d" in capsys.readouterr().err
