"""Architecture rules that import-linter cannot express, and consistency checks of documents."""

import argparse
import ast
import importlib.util
import json
import re
import subprocess
import sys
import tomllib
from collections import Counter
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from r2c2r_core.cli import build_parser

ROOT = Path(__file__).resolve().parent.parent


def test_stages_do_not_import_each_other() -> None:
    stages = ["ingest", "segment", "generate", "align", "synthesize", "warp", "export", "evaluate", "dataset", "synthetic"]
    for stage in stages:
        for path in (ROOT / "r2c2r_core" / stage).rglob("*.py"):
            for other in stages:
                if other != stage:
                    assert f"r2c2r_core.{other}" not in path.read_text(), f"{path} imports {other}"


def test_core_and_app_have_no_import_cycles() -> None:
    """A cycle is reported by its members; imports inside functions and for types count."""
    try:
        TopologicalSorter(import_graph(ROOT, "r2c2r_core", "app")).prepare()
    except CycleError as problem:
        pytest.fail(" imports ".join(reversed(problem.args[1])))


def test_import_cycles_are_detected_across_packages(tmp_path: Path) -> None:
    for name, code in {
        "core/__init__.py": "",
        "core/a.py": "def f():\n    from app import b\n",
        "app/__init__.py": "",
        "app/b.py": "from core.c import x\n",
        "core/c.py": "from . import a\n",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(code)
    with pytest.raises(CycleError):
        TopologicalSorter(import_graph(tmp_path, "core", "app")).prepare()
    (tmp_path / "core" / "c.py").write_text("x = 1\n")
    TopologicalSorter(import_graph(tmp_path, "core", "app")).prepare()


def import_graph(root: Path, *packages: str) -> dict[str, set[str]]:
    """Imports among the modules of these packages, by module."""
    paths = {path: path.relative_to(root).with_suffix("").parts for name in packages for path in (root / name).rglob("*.py")}
    modules = {".".join(parts[:-1] if parts[-1] == "__init__" else parts): path for path, parts in paths.items()}
    graph = {}
    for name, path in modules.items():
        package = name if path.stem == "__init__" else name.rpartition(".")[0]
        found = _imported(parsed(path), package) & modules.keys()
        members = {other.rpartition(".")[0] for other in found}  # `from package import module` names the package too
        graph[name] = {other for other in found if other not in members or "__init__" not in modules[other].name} - {name}
    return graph


def parsed(path: Path) -> ast.Module:
    """Syntax tree of a module; each text is parsed once for all tests."""
    return _parsed(path.read_text(encoding="utf-8"))


_parsed = cache(ast.parse)


SEGMENT = ROOT / "r2c2r_core" / "segment"


@pytest.mark.parametrize("room", sorted(path.parent for path in SEGMENT.rglob("__init__.py")), ids=lambda path: path.name)
def test_each_subpackage_of_segment_has_at_most_five_import_levels(room: Path) -> None:
    levels = import_levels(room)
    assert max(levels.values()) <= 5, {name: level for name, level in levels.items() if level > 5}


def test_subpackages_of_segment_import_only_those_listed_above_them() -> None:
    listed = re.findall(r"^\| (\w+) +\|", (SEGMENT / "__init__.py").read_text(), re.MULTILINE)[1:]
    assert sorted(listed) == sorted(path.parent.name for path in SEGMENT.glob("*/__init__.py"))
    for place, room in enumerate(listed):
        named = {name for path in (SEGMENT / room).rglob("*.py") for name in _imported(parsed(path), "")}
        above = {name.split(".")[2] for name in named if name.startswith("r2c2r_core.segment.")} & set(listed)
        assert above <= {room, *listed[:place]}, f"{room} imports {above - set(listed[:place])}"


def test_import_levels_are_counted_through_functions_and_relative_imports(tmp_path: Path) -> None:
    room = tmp_path / "r2c2r_core" / "room"
    room.mkdir(parents=True)
    (room / "a.py").write_text("import os\nfrom r2c2r_core.other.b import x\n")
    (room / "b.py").write_text("def f():\n    from r2c2r_core.room import a\n")
    (room / "c.py").write_text("from .b import f\n")
    (room / "d.py").write_text("import r2c2r_core.room.c as c\n")
    assert import_levels(room) == {"a": 1, "b": 2, "c": 3, "d": 4}
    (room / "a.py").write_text("from r2c2r_core.room.d import c\n")
    with pytest.raises(CycleError):
        import_levels(room)


def import_levels(room: Path) -> dict[str, int]:
    """Level of each module of a package: number of modules in the longest import chain from it within the package."""
    modules = {path.stem: parsed(path) for path in room.glob("*.py") if path.stem != "__init__"}
    package = ".".join(room.parts[room.parts.index("r2c2r_core") :])
    named = {name: _imported(tree, package) for name, tree in modules.items()}
    imports = {name: {other for other in modules if f"{package}.{other}" in named[name]} for name in modules}
    levels: dict[str, int] = {}
    for name in TopologicalSorter(imports).static_order():
        levels[name] = 1 + max((levels[other] for other in imports[name]), default=0)
    return levels


def _imported(tree: ast.Module, package: str) -> set[str]:
    """Every name that a module of `package` may import, anywhere in the module."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            source = ".".join(filter(None, [package, node.module])) if node.level == 1 else node.module or ""
            found |= {source, *(f"{source}.{alias.name}" for alias in node.names)}
    return found


HEAVY = (
    *("open3d", "mujoco", "scene_synthesizer", "pybullet", "viser", "trimesh"),
    *("opentelemetry.sdk", "opentelemetry.exporter"),  # imported only if a setting turns traces on
)
SHARED = ("psycopg", "obstore", "ray")
IMPORTS = """
import importlib, json, pkgutil, sys
from pathlib import Path
for name in ("torch", "transformers", "torchvision", "timm"):
    sys.modules[name] = None  # as on a base install: an import of it fails
loaded = {}
import app.main, app.work
loaded["app"] = list(sys.modules)
import r2c2r_core.cli, r2c2r_core.pipeline
loaded["core"] = list(sys.modules)
from tests.app.conftest import running
with running(Path(sys.argv[1])) as web:
    web.import_sample()
    loaded["served"] = list(sys.modules)
for package in (r2c2r_core, app):
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        # probes are programs of their own: they import what they probe; an extra's own package subclasses what the extra brings
        if "probes" not in found.name and not found.name.startswith("r2c2r_core.gym."):
            importlib.import_module(found.name)
loaded["everything"] = list(sys.modules)
print(json.dumps(loaded))
"""


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """Loaded modules of a process without torch after each step: app, core, a served project, every module."""
    command = [sys.executable, "-W", "ignore", "-c", IMPORTS, str(tmp_path_factory.mktemp("served") / "data")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


@pytest.mark.parametrize(("step", "heavy"), [("app", (*HEAVY, "shapely")), ("core", HEAVY), ("served", SHARED)])
def test_importing_loads_no_heavy_dependencies(step: str, heavy: tuple[str, ...], loaded: dict[str, list[str]]) -> None:
    assert set(heavy) & set(loaded[step]) == set()


def test_every_module_of_the_core_and_the_app_imports_without_torch(loaded: dict[str, list[str]]) -> None:
    assert {"r2c2r_core.align.glue", "app.viewer.camera"} <= set(loaded["everything"])


def test_base_install_needs_no_torch() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert not any("torch" in requirement or "transformers" in requirement for requirement in project["dependencies"])


def test_no_package_that_forbids_commercial_use_is_installed() -> None:
    """The licence of `triangle` forbids it: scene_synthesizer requires it, `make env` removes it, and no code needs it."""
    assert importlib.util.find_spec("triangle") is None, "take it away: pip uninstall triangle"


def test_alembic_folder_does_not_shadow_the_library() -> None:
    assert not (ROOT / "alembic" / "__init__.py").exists()


def test_no_large_file_is_tracked() -> None:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False).stdout.decode().split("\0")
    most = {".onnx": 5_000_000}  # weights shipped with the code
    sizes = {name: (ROOT / name).stat().st_size for name in listed if name and (ROOT / name).exists()}
    assert [name for name, size in sizes.items() if size > most.get(Path(name).suffix, 1_000_000)] == []


HURRIED = re.compile(r"time\.sleep\(|wait_for_timeout\(|\btimeout=[\d.]*[1-9]|\.(wait|join|result)\(\d")
"""A fixed wait, or a separate time limit: no number is right on every machine. A timeout of 0 is not a wait."""
MAY_HURRY = {
    "waiting.py": "the one wait that is of a length",
    "app/fakes/live.py": "takes its time as slow work does",
    "app/fakes/vary.py": "takes its time as slow work does",
    "app/fakes/worker.py": "takes its time as slow work does",
    "app/test_jobs.py": "a program that hangs",
    "app/test_live.py": "gives a thread the time to do what it must not",
    "app/test_node_seat.py": "programs that hang",
    "app/test_probe.py": "a program that hangs",
    "core/test_cli.py": "a program that hangs",
}


def test_tests_have_no_short_time_limits() -> None:
    """Tests use only the time limits of tests/waiting.py, and wait for conditions instead of durations."""
    tests = ROOT / "tests"
    hurried = [
        (path.relative_to(tests).as_posix(), number, line.strip())
        for path in sorted(tests.rglob("*.py"))
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if HURRIED.search(line)
    ]
    assert [found for found in hurried if found[0] not in MAY_HURRY] == []
    assert MAY_HURRY.keys() - {path for path, *_ in hurried} == set()  # exceptions are removed with the code that needed them


def test_the_readme_lists_every_command_and_is_short() -> None:
    readme = (ROOT / "README.md").read_text()
    commands = next(action.choices for action in build_parser()._actions if isinstance(action, argparse._SubParsersAction))
    assert [command for command in commands if f"`r2c2r {command}`" not in readme] == []
    assert len(readme.splitlines()) <= 150  # it is for users: all else is in docs/


MAX_CORE_LINES, MAX_PARAMS = 67_302, 1_268
"""Limits of r2c2r_core. A change that needs more raises the number here, in its own commit, with the reason."""


def test_the_core_stays_within_its_limits_of_lines_and_parameters() -> None:
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "r2c2r_core").rglob("*.py")]
    lines, params = sum(text.count("\n") for text in texts), sum(len(re.findall(r"\bparam\(", text)) for text in texts)
    assert (lines <= MAX_CORE_LINES, params <= MAX_PARAMS) == (True, True), f"{lines} lines, {params} param( calls"


OVERRIDES = {"do_GET", "do_POST", "do_DELETE", "log_message", "get_response"}  # called by http.server and Starlette


def test_every_public_function_is_used_outside_the_tests() -> None:
    product = {path: path.read_text(encoding="utf-8") for name in ("r2c2r_core", "app") for path in (ROOT / name).rglob("*.py")}
    users = [
        path.read_text(encoding="utf-8")
        for name in ("benchmarks", "training", "alembic")
        for path in (ROOT / name).rglob("*.py")
    ]
    words = Counter(word for text in (*product.values(), *users) for word in re.findall(r"\w+", text))
    defined = [
        (path, node.name)
        for path, text in product.items()
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not node.decorator_list
    ]
    unused = [f"{path.relative_to(ROOT)}: {name}" for path, name in defined if words[name] < 2 and name not in OVERRIDES]
    assert [line for line in unused if not line.rpartition(" ")[2].startswith("__")] == []


RIDDLES = ("What", "Which", "Whatever", "Nobody", "Of")


def test_docstrings_do_not_start_with_an_unclear_word() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {text.splitlines()[0]}"
        for name in ("r2c2r_core", "app")
        for path in sorted((ROOT / name).rglob("*.py"))
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and (text := ast.get_docstring(node))
        and text.split()[0].rstrip(",:") in RIDDLES
    ]
    assert found == []
