"""Command line from a user's view: exit codes, one-line errors."""

import argparse
import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core import cli
from r2c2r_core.cli import build_parser, main
from r2c2r_core.doctor import examine_machine
from r2c2r_core.export.loaders import APART
from r2c2r_core.synthetic.choices import LAYOUTS, PALETTES, STYLES

from .ingest.corruptions import Corruption, corrupt_r3d
from .ingest.tiny import TinyRoom, write_r3d


def r2c2r(*arguments: object, code: int) -> tuple[str, str]:
    """Output of the command called in this process, which saves the start of another."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            ended: object = main(list(map(str, arguments)))
        except SystemExit as left:
            ended = left.code
    assert ended == code, err.getvalue()
    return out.getvalue(), err.getvalue()


def started(*arguments: object, code: int) -> tuple[str, str]:
    """Output of the command started as a process."""
    done = subprocess.run(
        [sys.executable, "-m", "r2c2r_core.cli", *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    return done.stdout, done.stderr


def one_line(text: str) -> str:
    assert len(text.strip().splitlines()) == 1, text
    assert "Traceback" not in text
    return text


@pytest.fixture
def prompts(tmp_path: Path) -> Path:
    path = tmp_path / "prompts.json"
    point = {"frame": 0, "x": 1.0, "y": 1.0, "label": 1}
    path.write_text(json.dumps({"version": 1, "objects": [{"name": "a", "category": "drawer", "points": [point]}]}))
    return path


def test_help_and_version_are_printed() -> None:
    assert "COMMAND" in started("--help", code=0)[0]
    assert r2c2r("--version", code=0)[0].startswith("r2c2r ")


def test_every_option_has_a_help_text() -> None:
    silent = [
        f"{parser.prog} {action.dest}"
        for parser in commands_of(build_parser())
        for action in parser._actions
        if not action.help and not isinstance(action, argparse._SubParsersAction)
    ]
    assert silent == []


def commands_of(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield command
                yield from commands_of(command)


def test_wrong_usage_exits_with_code_2() -> None:
    started("fly", code=2)
    r2c2r("sample", "x", "--size", "big", code=2)


@pytest.mark.parametrize(("option", "names"), [("--style", STYLES), ("--palette", PALETTES), ("--layout", LAYOUTS)])
def test_sample_lists_its_choices_in_help_and_errors(option: str, names: dict[str, str]) -> None:
    said, _ = r2c2r("sample", "--help", code=0)
    _, refused = r2c2r("sample", "x", option, "baroque", code=2)
    for name, meaning in names.items():
        assert name in refused.splitlines()[-1]
        assert re.search(rf"^  {name} +{re.escape(meaning)}$", said, re.MULTILINE)


def test_a_missing_recording_is_reported_by_name(tmp_path: Path, prompts: Path) -> None:
    _, said = started("run", tmp_path / "no.r3d", "--prompts", prompts, "-o", tmp_path / "b.zip", code=2)
    assert "no.r3d" in one_line(said)


def test_unknown_fixtures_are_rejected_before_reading_the_scan(tmp_path: Path, prompts: Path) -> None:
    scan, config = tmp_path / "scan.r3d", tmp_path / "config.json"
    scan.write_bytes(b"not read")
    config.write_text('{"synthesize": {"fixtures": "flatpack"}}')
    _, said = r2c2r("run", scan, "--prompts", prompts, "-o", tmp_path / "b.zip", "--config", config, code=2)
    assert one_line(said).strip() == "r2c2r: unknown fixtures 'flatpack'; choose one of: boards, scene-synthesizer"


def test_the_paper_preset_reports_a_missing_extra_before_reading(
    tmp_path: Path, prompts: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "scene_synthesizer", None)
    scan = tmp_path / "scan.r3d"
    scan.write_bytes(b"not read")
    _, said = r2c2r("run", scan, "--prompts", prompts, "-o", tmp_path / "b.zip", "--preset", "paper", code=1)
    licence, error = said.splitlines()
    assert "fixtures scene-synthesizer" in licence
    assert error.endswith("missing scene_synthesizer; pip install 'r2c2r[scene-synthesizer]'")


def _tiny(folder: Path, depth_factor: float = 1.0) -> Path:
    """A recording of a box in a corner, its depth multiplied."""
    return corrupt_r3d(
        Corruption(name="unit", depth=lambda depth, _: depth * np.float32(depth_factor)),
        write_r3d(folder / "good.r3d", TinyRoom(count=6)),
        folder / "scan.r3d",
    )


def test_a_hopeless_scan_is_rejected_with_a_fix_before_computing(tmp_path: Path, prompts: Path) -> None:
    work = tmp_path / "work"
    command = ("run", _tiny(tmp_path, 1000.0), "--prompts", prompts, "-o", tmp_path / "b.zip", "--workdir", work)
    _, said = r2c2r(*command, code=2)
    last = said.strip().splitlines()[-1]
    assert "--depth-scale 0.001" in last
    assert not list((work / "nouns").glob("segment/*"))
    _, said = r2c2r(*command, "--depth-scale", "0.001", code=1)  # it is read; then the click on nothing fails
    assert "not in the unit" not in said
    assert "unusable" not in said
    _, said = r2c2r(*command, "--depth-scale", "none", code=2)
    assert "expected a positive number" in said


def test_doubts_about_a_recording_are_printed_before_computing(
    tmp_path: Path, prompts: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from r2c2r_core.ingest.doctor.doubts import Doubts

    told = Doubts(reasons=("depth lies beside colour; read it with --register-depth", "and more"), hopeless=False)
    said_before: list[str] = []

    def reconstruct(*_: object, **__: object) -> None:
        said_before.append(capsys.readouterr().err)
        raise KeyboardInterrupt

    monkeypatch.setattr("r2c2r_core.pipeline.doubts_about", lambda *_, **__: told)
    monkeypatch.setattr("r2c2r_core.pipeline.reconstruct", reconstruct)
    main(["run", str(_tiny(tmp_path)), "--prompts", str(prompts), "-o", str(tmp_path / "b.zip")])
    lines = [line for line in said_before[0].splitlines() if "unusable" in line]
    assert len(lines) == 1
    assert "--register-depth (and 1 more: `r2c2r info` lists them); the run continues" in lines[0]


def test_a_file_that_is_no_zip_is_reported_by_name(tmp_path: Path, prompts: Path) -> None:
    scan = tmp_path / "scan.r3d"
    scan.write_bytes(b"not a zip at all")
    _, said = r2c2r("info", scan, code=2)
    assert "scan.r3d" in one_line(said.splitlines()[-1])


def test_invalid_prompts_json_is_reported_by_name(tmp_path: Path, prompts: Path) -> None:
    prompts.write_text("{")
    (tmp_path / "scan.r3d").write_bytes(b"")
    _, said = r2c2r("run", tmp_path / "scan.r3d", "--prompts", prompts, "-o", tmp_path / "b.zip", code=2)
    assert "prompts.json" in one_line(said)


def test_an_unknown_setting_is_reported_by_name(tmp_path: Path, prompts: Path) -> None:
    (tmp_path / "scan.r3d").write_bytes(b"")
    config = tmp_path / "config.json"
    config.write_text(json.dumps({"segment": {"no_such": 1}}))
    _, said = r2c2r("run", tmp_path / "scan.r3d", "--prompts", prompts, "-o", tmp_path / "b.zip", "--config", config, code=2)
    assert "no_such" in one_line(said)


def test_an_invalid_bundle_is_reported_by_name(tmp_path: Path) -> None:
    (tmp_path / "b.zip").write_bytes(b"PK")
    assert "b.zip" in r2c2r("check", tmp_path / "b.zip", code=2)[1]


def test_missing_segmenter_weights_are_reported_before_reading(torch_found: None, tmp_path: Path, prompts: Path) -> None:
    (tmp_path / "scan.r3d").write_bytes(b"")
    config = tmp_path / "config.json"
    config.write_text(json.dumps({"segment": {"weights": str(tmp_path / "nowhere")}}))
    given = ("run", tmp_path / "scan.r3d", "--prompts", prompts, "-o", tmp_path / "b.zip", "--config", config)
    said = one_line(r2c2r(*given, "--segmenter", "sam2", code=1)[1])
    assert "no weights at" in said
    assert "R2C2R_SAM2_WEIGHTS" in said


def test_doctor_lists_every_segmenter_and_licence(tmp_path: Path) -> None:
    said, _ = r2c2r("doctor", "--data", tmp_path, "--json", tmp_path / "d.json", code=0)
    for name in ("geometric", "sam2", "edgetam", "sam3"):
        assert f"segmenter {name}" in said
    assert "uploads are decoded with" in said
    assert "SAM License" in said
    assert "licence" in said.lower() or "Apache" in said
    assert json.loads((tmp_path / "d.json").read_text())["version"] == 1


def test_doctor_reports_the_environments_of_loaders(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for own in APART.values():
        monkeypatch.delenv(own.variable, raising=False)
    monkeypatch.setenv("R2C2R_DRAKE_PYTHON", sys.executable)
    monkeypatch.setenv("R2C2R_GENESIS_PYTHON", str(tmp_path / "python"))
    found = {finding.what: finding for finding in examine_machine(tmp_path)}
    assert {found[f"loader {name}"].state for name in APART} == {"ok", "absent", "problem"}
    assert found["loader Drake"].detail == sys.executable
    assert found["loader Genesis"].detail == f"R2C2R_GENESIS_PYTHON is {tmp_path / 'python'}, which does not exist"
    assert "set R2C2R_NEWTON_PYTHON" in found["loader Newton"].detail


@pytest.mark.parametrize(
    "arguments",
    [
        ("serve", "--port", "-1"),
        ("serve", "--port", "99999"),
        ("demo", "--port", "9" * 5000),
        ("sample", "x", "--seed", "-1"),
        ("sample", "x", "--frames", "1000000000"),
        ("sample", "x", "--size", "99999x99999"),
        ("run", "x", "--prompts", "p", "-o", "b.zip", "--seed", "1e9"),
    ],
)
def test_a_number_out_of_range_is_a_usage_error(arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert "expected" in one_line(capsys.readouterr().err.splitlines()[-1])


def test_internal_errors_are_one_line_and_a_traceback_with_debug(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("two\nlines")

    monkeypatch.setattr("r2c2r_core.export.stage.check_bundle", broken)
    assert main(["check", str(tmp_path)]) == 1
    said = one_line(capsys.readouterr().err)
    assert "internal error (ZeroDivisionError: two lines); run again with --debug" in said
    assert main(["--debug", "check", str(tmp_path)]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_a_path_that_is_too_long_is_not_reported_as_a_full_disk(
    tmp_path: Path, prompts: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", str(tmp_path / ("n" * 300))]) == 2
    assert "too long; check the path" in one_line(capsys.readouterr().err)
    bundle = tmp_path / ("n" * 252 + ".zip")
    (tmp_path / "scan.r3d").write_bytes(b"")
    assert main(["run", str(tmp_path / "scan.r3d"), "--prompts", str(prompts), "-o", str(bundle)]) != 0
    assert "free some space" not in one_line(capsys.readouterr().err)


def test_a_named_pipe_is_rejected_without_blocking(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "pipe")
    for command in ("info", "check", "dataset"):
        assert main([command, str(tmp_path / "pipe"), *(["-o", "x"] if command == "dataset" else [])]) == 2
        assert "a pipe, expected a file or a folder" in one_line(capsys.readouterr().err)


def test_sigterm_prints_one_line_and_leaves_no_temporary_folder(tmp_path: Path) -> None:
    waiting = (
        "import argparse, sys, tempfile, time\n"
        "from pathlib import Path\n"
        "from r2c2r_core import cli\n"
        "from r2c2r_core.commands import doctor\n"
        "def wait(_):\n"
        "    with tempfile.TemporaryDirectory(prefix='r2c2r-info-'):\n"
        "        print('waiting', flush=True)\n"
        "        time.sleep(600)\n"
        "doctor.doctor = wait\n"
        "sys.exit(cli.main(['doctor']))\n"
    )
    place = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", waiting], env=place, stdout=-1, stderr=-1, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == "waiting\n"
        assert [path.name[:11] for path in tmp_path.iterdir()] == ["r2c2r-info-"]
        process.terminate()
        said = process.stderr.read()
        assert process.wait() == 143
    assert said == "r2c2r: stopped; finished stages are kept, run the same command to continue\n"
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_while_importing_commands_prints_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_commands", interrupted)
    assert cli.main(["doctor"]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_without_a_home_folder_only_the_commands_that_need_one_say_so(tmp_path: Path) -> None:
    nobody = (
        "import os, pwd, sys\n"
        "def unknown(uid): raise KeyError(f'getpwuid(): uid not found: {uid}')\n"
        "pwd.getpwuid = unknown\n"
        "from r2c2r_core.cli import main\n"
        "print([main(['info', 'nothing']), main(['key']), main(['key', '--data', sys.argv[1]])])\n"
    )
    lacking = {name: value for name, value in os.environ.items() if name not in ("HOME", "R2C2R_DATA")}
    words = [sys.executable, "-c", nobody, str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, env=lacking, check=True)
    nothing, homeless, unserved = done.stderr.splitlines()
    assert "nothing: no such file or folder" in nothing
    assert "no home folder; set HOME or R2C2R_DATA" in homeless
    assert "no r2c2r serves this folder" in unserved


def test_doctor_does_not_call_a_missing_or_unwritable_data_folder_private(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def told() -> tuple[str, str]:
        found = next(f for f in examine_machine(tmp_path / "none" / "r2c2r") if f.what == "data folder")
        return found.state, found.detail

    assert told()[1].endswith("does not exist yet: the first start makes it")
    monkeypatch.setattr(os, "access", lambda *_: False)  # a read-only file system: root may write all else
    state, detail = told()
    assert state == "problem"
    assert "set R2C2R_DATA" in detail
