"""Digests of the code that determines a result."""

import os
import shutil
from pathlib import Path
from typing import get_args

import grimp
import pytest

from r2c2r_core import sources
from r2c2r_core.ledger import Stage
from r2c2r_core.sources import modules_of, source_files, source_key

STAGES = get_args(Stage)


def test_source_files_include_page_assets_and_exclude_compiled_code(tmp_path: Path) -> None:
    package = tmp_path / ".venv" / "export"
    for name in ("stage.py", "review_page/page.js", "review_page/page.css", "__pycache__/stage.pyc", ".stage.py.swp"):
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    found = [str(path.relative_to(package)) for path in source_files(package)]
    assert found == ["review_page/page.css", "review_page/page.js", "stage.py"]


@pytest.mark.parametrize(
    ("changed", "stages"),
    [
        ("robot/opening.py", {"export"}),
        ("robot/gripper.xml", {"export"}),
        ("calibration.py", {"segment", "synthesize"}),
        ("export/report_page/page.css", {"export"}),
        ("geometry/transforms.py", set(STAGES)),
        ("gym/opening.py", set()),
    ],
)
def test_a_changed_file_changes_the_keys_of_the_stages_that_reach_it(
    core: Path, monkeypatch: pytest.MonkeyPatch, changed: str, stages: set[str]
) -> None:
    monkeypatch.setattr(sources, "PACKAGE", core)
    before = {stage: source_key(stage) for stage in STAGES}
    edited = shutil.copytree(core, core.with_name(changed.replace("/", "_")), copy_function=os.link)
    text = (edited / changed).read_text()
    (edited / changed).unlink()
    (edited / changed).write_text(text + "\n")
    monkeypatch.setattr(sources, "PACKAGE", edited)
    assert {stage for stage in STAGES if source_key(stage) != before[stage]} == stages


def test_a_key_includes_every_module_that_the_import_graph_reaches() -> None:
    graph = grimp.build_graph("r2c2r_core", cache_dir=None)
    for stage in STAGES:
        reached = graph.find_upstream_modules(f"r2c2r_core.{stage}", as_package=True)
        assert {name.removeprefix("r2c2r_core.") for name in reached} <= modules_of(stage), stage


def test_a_key_includes_no_module_of_another_stage() -> None:
    for stage in STAGES:
        assert {name.partition(".")[0] for name in modules_of(stage)} & {*STAGES, "pipeline"} == {stage}


def test_backends_named_in_strings_belong_to_the_code_of_their_table() -> None:
    assert {"align.sift", "align.superglue", "align.protocol"} <= modules_of("align.stage")


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the core's code and pages, without its large networks."""
    ignored = shutil.ignore_patterns("__pycache__", "*.onnx")
    return Path(shutil.copytree(sources.PACKAGE, tmp_path_factory.mktemp("code") / "core", ignore=ignored))
