"""The command line as a person meets it: exit codes, one-line errors."""

import json
import subprocess
import sys
from pathlib import Path

import pytest


def r2c2r(*arguments: object, code: int) -> tuple[str, str]:
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


def test_help_and_version() -> None:
    assert "COMMAND" in r2c2r("--help", code=0)[0]
    assert r2c2r("--version", code=0)[0].startswith("r2c2r ")


def test_wrong_usage_is_two() -> None:
    r2c2r("fly", code=2)
    r2c2r("sample", "x", "--size", "big", code=2)


def test_a_missing_recording_is_named(tmp_path: Path, prompts: Path) -> None:
    _, said = r2c2r("run", tmp_path / "no.r3d", "--prompts", prompts, "-o", tmp_path / "b.zip", code=2)
    assert "no.r3d" in one_line(said)


def test_a_foreign_zip_is_named(tmp_path: Path, prompts: Path) -> None:
    scan = tmp_path / "scan.r3d"
    scan.write_bytes(b"not a zip at all")
    _, said = r2c2r("info", scan, code=2)
    assert "scan.r3d" in one_line(said.splitlines()[-1])


def test_prompts_that_are_not_json_are_named(tmp_path: Path, prompts: Path) -> None:
    prompts.write_text("{")
    (tmp_path / "scan.r3d").write_bytes(b"")
    _, said = r2c2r("run", tmp_path / "scan.r3d", "--prompts", prompts, "-o", tmp_path / "b.zip", code=2)
    assert "prompts.json" in one_line(said)


def test_an_unknown_backend_lists_the_choices(tmp_path: Path, prompts: Path) -> None:
    (tmp_path / "scan.r3d").write_bytes(b"")
    config = tmp_path / "config.json"
    config.write_text(json.dumps({"segment": {"no_such": 1}}))
    _, said = r2c2r("run", tmp_path / "scan.r3d", "--prompts", prompts, "-o", tmp_path / "b.zip", "--config", config, code=2)
    assert "no_such" in one_line(said)


def test_a_bundle_that_is_no_bundle_is_named(tmp_path: Path) -> None:
    (tmp_path / "b.zip").write_bytes(b"PK")
    assert "b.zip" in r2c2r("check", tmp_path / "b.zip", code=2)[1]


def test_a_segmenter_without_weights_says_how_to_get_them_before_reading_anything(tmp_path: Path, prompts: Path) -> None:
    (tmp_path / "scan.r3d").write_bytes(b"")
    config = tmp_path / "config.json"
    config.write_text(json.dumps({"segment": {"weights": str(tmp_path / "nowhere")}}))
    given = ("run", tmp_path / "scan.r3d", "--prompts", prompts, "-o", tmp_path / "b.zip", "--config", config)
    said = one_line(r2c2r(*given, "--segmenter", "sam2", code=1)[1])
    assert "no weights at" in said
    assert "R2C2R_SAM2_WEIGHTS" in said


def test_doctor_names_every_backend_and_licence(tmp_path: Path) -> None:
    said, _ = r2c2r("doctor", "--data", tmp_path, "--json", tmp_path / "d.json", code=0)
    for name in ("geometric", "sam2", "edgetam", "sam3"):
        assert f"segmenter {name}" in said
    assert "SAM License" in said
    assert "licence" in said.lower() or "Apache" in said
    assert json.loads((tmp_path / "d.json").read_text())["version"] == 1
