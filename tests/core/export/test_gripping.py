"""Gripper tests within the certificate: equal results for any number of processes."""

import shutil
from pathlib import Path

import pytest

from r2c2r_core.export.gripping import begin_gripping
from r2c2r_core.model.report import Certificate
from r2c2r_core.pool import Failed, Pool, WorkerLost
from r2c2r_core.robot.certificate import Grip

Bundle = tuple[Path, Certificate]


def test_one_and_two_workers_give_the_same_gripper_results(kitchen_bundle: Bundle, tmp_path: Path) -> None:
    told = []
    for workers in (1, 2):
        folder = tmp_path / str(workers)
        shutil.copytree(kitchen_bundle[0].with_suffix(""), folder)
        shutil.rmtree(folder / "gripper", ignore_errors=True)
        with Pool(workers) as pool:
            told.append(begin_gripping(folder, pool)())
    assert told[0] is not None
    assert told[0]["grips"]
    assert told[0] == told[1]
    pictures = [sorted(path.name for path in (tmp_path / str(workers) / "gripper").iterdir()) for workers in (1, 2)]
    assert pictures[0] == pictures[1] == sorted(f"{grip['film']}.jpg" for grip in told[0]["grips"] if grip["film"])


@pytest.mark.parametrize("workers", [1, 2])
def test_gripping_says_why_mujoco_cannot_load_the_scene(tmp_path: Path, workers: int) -> None:
    (tmp_path / "scene.xml").write_text("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>")
    with Pool(workers) as pool:
        told = begin_gripping(tmp_path, pool)()
    assert list(told) == ["why"]
    assert "the gripper: ValueError: " in told["why"]


def test_a_lost_process_loses_only_its_own_trials(kitchen_bundle: Bundle, monkeypatch: pytest.MonkeyPatch) -> None:
    lost = Failed(WorkerLost("its process ended (SIGKILL)"), "")
    kept = Grip(kind="joint", name="first", method="pinch", passed=True)
    with Pool(2) as pool:
        monkeypatch.setattr(Pool, "run", lambda *_: iter({"0": [kept], "1": lost}.items()))
        told = begin_gripping(kitchen_bundle[0].with_suffix(""), pool)()
    first, *others = told["grips"]
    assert (first["name"], first["passed"]) == ("first", True)
    assert others
    assert all(not grip["passed"] and "its process ended (SIGKILL)" in grip["why"] for grip in others)
    assert all(grip["blame"] is None for grip in others)


def test_gripping_starts_before_its_result_is_requested(kitchen_bundle: Bundle) -> None:
    with Pool(2) as pool:
        begin_gripping(kitchen_bundle[0].with_suffix(""), pool)
        assert len(pool._busy) == 2
