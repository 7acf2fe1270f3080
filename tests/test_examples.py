"""Every file of examples/ runs, on a sample too small for meaningful results."""

import os
import runpy
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.main import create_app
from app.settings import Settings
from r2c2r_core.export.loaders import APART
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.synthetic.stage import SamplePaths, write_sample
from tests.app.conftest import FAKE_COMMANDS
from tests.app.served import served
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import kitchen

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
Run = Callable[..., str]


def opens_fully(said: str) -> bool:
    """Whether every line of an example's output reports a joint that reached its end, within 5 %."""
    ends = [line.rsplit(": ", 1)[1].split(" of ") for line in said.strip().splitlines()]
    return bool(ends) and all(abs(float(reached) - float(upper)) < 0.05 * float(upper) for reached, upper in ends)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run an example with arguments; return its output."""

    def ran(name: str, *arguments: object) -> str:
        monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
        return capsys.readouterr().out

    return ran


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> SamplePaths:
    return write_sample(tmp_path_factory.mktemp("sample"), frames=10, size=(256, 192))


def test_every_example_is_run_by_this_file() -> None:
    source = Path(__file__).read_text()
    assert [name for name in sorted(path.stem for path in EXAMPLES.glob("*.py")) if f'"{name}"' not in source] == []


@pytest.mark.parametrize("example", sorted(path.stem for path in EXAMPLES.glob("*.py")))
def test_an_example_without_arguments_prints_its_usage(run: Run, example: str) -> None:
    with pytest.raises(SystemExit, match=f"python examples/{example}.py [A-Z]"):
        run(example)


def test_the_capture_example_reads_ten_frames(run: Run, sample: SamplePaths) -> None:
    assert "10 frames" in run("read_a_capture", sample.scan)


def test_the_click_example_writes_a_cutout(run: Run, sample: SamplePaths, tmp_path: Path) -> None:
    click = read_prompts(sample.prompts).objects[0]
    point = click.points[0]
    said = run("click_and_cut", sample.scan, click.category, point.frame, point.x, point.y, tmp_path / "cut.png")
    assert "frames" in said
    assert (tmp_path / "cut.png").stat().st_size > 1000


@pytest.mark.slow
def test_the_candidates_example_writes_meshes(run: Run, sample: SamplePaths, tmp_path: Path) -> None:
    drawer = next(found.name for found in read_prompts(sample.prompts).objects if found.category == "drawer")
    said = run("candidates", sample.scan, sample.prompts, drawer, tmp_path)
    assert "is chosen" in said
    assert list(tmp_path.glob("*.ply"))


def test_the_mujoco_example_opens_every_joint(run: Run, tmp_path: Path) -> None:
    said = run("bundle_in_mujoco", write_folder(kitchen(), tmp_path / "bundle"))
    assert len(said.strip().splitlines()) >= 3
    assert opens_fully(said), said


@pytest.mark.parametrize("example", ["asset_in_mujoco", "asset_in_pybullet"])
@pytest.mark.parametrize("name", ["drawer_1", "cabinet_1"])
def test_an_asset_referenced_from_another_folder_opens(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, example: str, name: str
) -> None:
    if example == "asset_in_pybullet":
        pytest.importorskip("pybullet", reason="pip install pybullet")
    write_folder(kitchen(), tmp_path / "bundle")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    said = run(example, "../bundle", name)
    assert opens_fully(said), said
    with pytest.raises(SystemExit, match="there is no such object"):
        run(example, "../bundle", "fridge")


def test_an_asset_referenced_from_another_usd_stage_opens(run: Run, tmp_path: Path) -> None:
    """The stage resolves without Newton; in Newton's environment, the joint also stops at its limit."""
    from pxr import Usd, UsdUtils

    folder, stage = write_folder(kitchen(), tmp_path / "bundle"), tmp_path / "stage.usda"
    newton = os.environ.get(APART["Newton"].variable)
    if newton:
        command = [newton, str(EXAMPLES / "asset_in_usd.py"), str(folder), "drawer_1", str(stage)]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        assert opens_fully("\n".join(line for line in said.splitlines() if " of " in line)), said
    else:
        assert run("asset_in_usd", folder, "drawer_1", stage).startswith("not run: ")
    opened = Usd.Stage.Open(str(stage))
    assert opened.GetPrimAtPath("/World/unit/joints/drawer_1_slide").IsValid()
    _, _, unresolved = UsdUtils.ComputeAllDependencies(str(stage))
    assert not unresolved
    with pytest.raises(SystemExit, match="there is no such object"):
        run("asset_in_usd", folder, "fridge", stage)


def test_the_robot_examples_run_or_name_the_missing_package(run: Run, tmp_path: Path) -> None:
    folder = write_folder(kitchen(), tmp_path / "bundle")
    said = [
        run("bundle_in_isaac_lab", folder, "drawer_1"),
        run("bundle_in_maniskill", folder),
        run("bundle_in_robosuite", folder),
    ]
    for lines in said:
        assert lines.startswith("not run: ") or "drawer_1_slide: 0.4" in lines, lines
    with pytest.raises(SystemExit, match="there is no such object"):
        run("bundle_in_isaac_lab", folder, "fridge")


def test_the_learning_example_improves_drawer_opening(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("gymnasium", reason="gymnasium is not installed: pip install 'r2c2r[gym]'")
    said = run("learn_to_open", write_folder(kitchen(), tmp_path / "bundle"), "drawer_1_slide", 3, 3).splitlines()
    assert said[0] == "before: 0 of 3"
    assert int(said[1].split(": ")[1][0]) >= 2, said


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """A server on a free port with stand-in workers; the address it would print."""
    settings = Settings(data_dir=tmp_path, host="127.0.0.1", min_free_bytes=0, job_memory_bytes=0)
    with served(create_app(settings, commands=FAKE_COMMANDS)) as port:
        yield f"http://127.0.0.1:{port}/?token={settings.launch_token}"


def test_the_api_example_completes_a_run(run: Run, address: str) -> None:
    said = run("drive_the_api", address)
    assert "drawer_1" in said
    assert "run done" in said
    assert "version 1" in said
