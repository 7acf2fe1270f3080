"""Gripper tests within the certificate: equal results for any number of processes."""

import shutil
from pathlib import Path

import pytest

from r2c2r_core.export.gripping import begin_gripping
from r2c2r_core.model.report import Certificate
from r2c2r_core.pool import Pool

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
def test_gripping_returns_none_for_a_scene_mujoco_cannot_load(tmp_path: Path, workers: int) -> None:
    (tmp_path / "scene.xml").write_text("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>")
    with Pool(workers) as pool:
        assert begin_gripping(tmp_path, pool)() is None


def test_gripping_starts_before_its_result_is_requested(kitchen_bundle: Bundle) -> None:
    with Pool(2) as pool:
        begin_gripping(kitchen_bundle[0].with_suffix(""), pool)
        assert len(pool._busy) == 2
