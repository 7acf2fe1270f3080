import json
from dataclasses import replace
from pathlib import Path

import pytest

from r2c2r_core.cli import main
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import drawer, kitchen


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(kitchen(), tmp_path_factory.mktemp("commands") / "kitchen")


def test_check_prints_the_gripper_results_and_writes_films(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", str(folder), "--gripper", "--films", str(tmp_path / "films"), "--json", str(tmp_path / "found.json")])
    said = capsys.readouterr().out
    assert "the gripper opens and closes 4 of 4 joints and moves 0 of 1 free things" in said
    assert "bottle_1_body: wider than 76 mm all round (the world)" in said
    found = json.loads((tmp_path / "found.json").read_text())["gripper"]
    assert {f"{grip['film']}.gif" for grip in found["grips"] if grip["film"]} == {
        p.name for p in (tmp_path / "films").glob("*.gif")
    }


def test_check_prints_the_arm_results_and_writes_films(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pybullet_data", reason="the arm's description is in pybullet's wheel")
    one = write_folder(replace(kitchen(), objects=(drawer("drawer_1"),)), tmp_path / "kitchen")
    main(["check", str(one), "--arm", "--films", str(tmp_path / "films"), "--json", str(tmp_path / "found.json")])
    assert "a Franka Panda opens and closes 1 of 1 joints from 1 places" in capsys.readouterr().out
    found = json.loads((tmp_path / "found.json").read_text())["arm"]
    assert found["places"][0]["joints"] == ["drawer_1_slide"]
    assert {path.name for path in (tmp_path / "films" / "arm").iterdir()} == {
        "drawer_1_slide.gif",
        "drawer_1_slide.jpg",
        "standing.svg",
    }


def test_films_without_gripper_or_arm_is_a_usage_error(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(folder), "--films", str(tmp_path)]) == 2
    assert capsys.readouterr().err.strip() == (
        "r2c2r: --films: there is nothing to film without --gripper or --arm; add --gripper or --arm"
    )


def test_vary_prints_its_results_and_requires_an_empty_folder(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["vary", str(folder), "-n", "2", "-o", str(tmp_path / "v")]) == 0
    assert "certificates of 2 random variants: 2 passed" in capsys.readouterr().out
    assert {path.name for path in (tmp_path / "v").iterdir()} == {"base", "textures", "variants", "variants.json", "wall.jpg"}
    assert main(["vary", str(folder), "-n", "2", "-o", str(tmp_path / "v")]) == 2
    assert "is not empty" in capsys.readouterr().err
