"""Third-party plugin packages, installed as metadata and files on the path and used by the command line's code."""

import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core import cli, plugins
from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.errors import BackendUnavailable, CaptureError, InputError
from r2c2r_core.export.lint import lint
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.support import supported
from r2c2r_core.export.writers.table import FORMATS, formats, write_formats
from r2c2r_core.generate.stage import GENERATORS, GenerateConfig, generate_candidates
from r2c2r_core.geometry.meshes import is_watertight
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.kitchen.names import category_of, named
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.registry import Registry
from r2c2r_core.segment.stage import SEGMENTERS
from r2c2r_core.sources import source_key
from r2c2r_core.synthesize.fixtures.spec import Order
from r2c2r_core.synthesize.fixtures.table import fixture_of
from tests.core.export.conftest import write_folder, write_meshes
from tests.core.export.kitchen import kitchen
from tests.core.generate import scenes

Install = Callable[..., Path]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Put a one-module package with entry points on the path; return the module's file."""
    monkeypatch.syspath_prepend(tmp_path)
    loaded = set(sys.modules)

    def installed(module: str, group: str, entry: str, code: str) -> Path:
        file = tmp_path / f"{module}.py"
        file.write_text(code)
        metadata = tmp_path / f"{module}-1.2.dist-info"
        metadata.mkdir(exist_ok=True)
        (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.2\n")
        (metadata / "entry_points.txt").write_text(f"[{group}]\n{entry}\n")
        plugins.forget()
        return file

    plugins.forget()
    yield installed
    for name in set(sys.modules) - loaded:
        if (tmp_path / f"{name}.py").exists():
            del sys.modules[name]
    monkeypatch.undo()
    plugins.forget()


@pytest.fixture(scope="module")
def bottle_scene() -> tuple[Capture, MaskTrack]:
    return scenes.bottle_scene()


READER = """
from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.readers.protocol import Part, Reader

def read(files):
    raise CaptureError("the depths of a sonar are not understood yet", hint="come back later")

READER = Reader(name="Sonar", parts=(Part("pings.sonar", r"pings\\.sonar"),), open=read)
"""
BACKEND = """
from r2c2r_core.registry import Backend

LINE = Backend(name="oracle", target="delphi:Oracle", summary="knows", licence="MIT")

class Oracle:
    def describe(self, image, mask): ...
    def match(self, first, second): ...
    def match_many(self, first, others): ...
    def make(self, evidence, candidate_id, seed): ...
    def open(self, capture, cache, config, *, progress): ...
"""
FIXTURE = """
from dataclasses import replace

from r2c2r_core.kitchen.categories import CATEGORIES
from r2c2r_core.synthesize.fixtures import cabinet
from r2c2r_core.synthesize.fixtures.spec import Fixture

LARDER = replace(
    next(kind for kind in CATEGORIES if kind.name == "cabinet"), name="wine_larder", aliases=("bodega",), fixture="larder:TALL"
)
TALL = Fixture(build=cabinet.build)
"""
FORMAT = """
from pathlib import Path

from r2c2r_core.export.writers.table import Format

def write(plan, folder):
    Path(folder / "scene.count" if folder.is_dir() else folder).write_text(str(len(plan.bodies)))

def check(path):
    if not path.read_text().isdigit():
        yield f"holds {path.read_text()!r}, a number is expected"

COUNT = Format(
    name="count", file="scene.count", opened_by="counters", reads_meshes=False, write=write, loses=("all shapes",), check=check
)
"""


OWN_PACKAGE = Path(__file__).resolve().parent.parent / "examples" / "own_package"


def own_entry(group: str) -> tuple[str, str, str]:
    """Module, entry point and code of the example package, from its pyproject.toml."""
    ((name, target),) = tomllib.loads((OWN_PACKAGE / "pyproject.toml").read_text())["project"]["entry-points"][group].items()
    module = target.partition(":")[0]
    return module, f"{name} = {target}", (OWN_PACKAGE / f"{module}.py").read_text()


def write_numpy_scan(scan: Path, frames: int) -> list[Rigid3]:
    """A wall 2 m away with a box 0.4 m before it, filmed from places 0.1 m apart; returns the camera poses."""
    scan.mkdir()
    towards_y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    camera = np.array([[80.0, 0.0, 48.0], [0.0, 80.0, 36.0], [0.0, 0.0, 1.0]])
    poses = [Rigid3(towards_y, np.array([0.1 * k, 0.0, 1.2])) for k in range(frames)]
    for k, pose in enumerate(poses):
        depth = np.full((72, 96), 2.0, np.float32)
        depth[24:48, 30 - 5 * k : 60 - 5 * k] = 1.6  # 0.1 m are 5 px of 80 at 1.6 m
        rgb = np.random.default_rng(k).integers(0, 255, (72, 96, 3), np.uint8)
        np.savez(scan / f"frame_{k}.npz", rgb=rgb, depth_m=depth, camera=camera, world_from_camera=pose.matrix)
    return poses


def doctors_lines(capsys: pytest.CaptureFixture[str]) -> str:
    cli.main(["doctor"])
    return capsys.readouterr().out


def test_the_recording_format_of_a_plugin_is_recognised(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    (scan / "pings.sonar").write_bytes(b"ping")
    assert cli.main(["info", str(scan)]) == 2
    assert "no known recording format" in capsys.readouterr().err
    install("sonar", "r2c2r.readers", "sonar = sonar:READER", READER)
    assert cli.main(["info", str(scan)]) == 2
    assert "the depths of a sonar are not understood yet" in capsys.readouterr().err
    assert "plug-in sonar" in doctors_lines(capsys)


def test_a_recording_in_the_format_of_a_plugin_is_read(install: Install, tmp_path: Path) -> None:
    install(own_entry("r2c2r.readers")[0], "r2c2r.readers", *own_entry("r2c2r.readers")[1:])
    poses = write_numpy_scan(tmp_path / "scan", frames=3)
    capture = read_capture(tmp_path / "scan", tmp_path / "frames", IngestConfig())
    assert (capture.format, len(capture.frames)) == ("NumPy frames", 3)
    for frame, pose in zip(capture.frames, poses, strict=True):
        stood = (capture.world_from_capture @ pose).matrix
        np.testing.assert_allclose(frame.world_from_camera.matrix, stood, atol=5e-3)  # 5 mm: poses may be refined
        depth = capture.images.depth(frame.index).metres
        assert depth[36, 80] == pytest.approx(2.0, abs=1e-3)  # quantisation step of the store: 0.25 mm
        assert depth[36, 40] == pytest.approx(1.6, abs=1e-3)
    (tmp_path / "scan" / "frame_1.npz").write_bytes(b"PK")
    with pytest.raises(CaptureError, match=r"frame_1\.npz"):
        read_capture(tmp_path / "scan", tmp_path / "other", IngestConfig())


def test_the_generator_of_a_plugin_makes_the_candidates(install: Install, bottle_scene: tuple[Capture, MaskTrack]) -> None:
    module, entry, code = own_entry("r2c2r.generators")
    install(module, "r2c2r.generators", entry, code)
    found = generate_candidates(*bottle_scene, "convex-hull", GenerateConfig(count=2, pool_frames=6))
    assert [asset.candidate_id for asset in found.candidates] == ["c0", "c1"]
    for asset in found.candidates:
        assert asset.generator == "convex-hull"
        assert is_watertight(asset.mesh.vertices, asset.mesh.faces)
        assert asset.world_from_mesh is not None
        stood = asset.world_from_mesh.apply(asset.mesh.vertices)
        np.testing.assert_allclose((stood.max(axis=0) + stood.min(axis=0)) / 2, (0.0, 0.0, 1.04), atol=0.03)
    assert found.chosen_id in ("c0", "c1")


@pytest.mark.parametrize(
    ("group", "table"), [("r2c2r.segmenters", SEGMENTERS), ("r2c2r.generators", GENERATORS), ("r2c2r.matchers", MATCHERS)]
)
def test_the_backend_of_a_plugin_is_loaded_by_name(
    install: Install, group: str, table: Registry, capsys: pytest.CaptureFixture[str]
) -> None:
    default = table.default
    with pytest.raises(InputError):
        table.get("oracle")
    install("delphi", group, "oracle = delphi:LINE", BACKEND)
    assert type(table.load("oracle")).__name__ == "Oracle"
    assert table.default == default
    assert f"{table.seam} oracle" in doctors_lines(capsys)


@pytest.mark.parametrize(
    ("group", "table", "method", "protocol"),
    [
        ("r2c2r.segmenters", SEGMENTERS, "open", "r2c2r_core.segment.protocol.Segmenter"),
        ("r2c2r.generators", GENERATORS, "make", "r2c2r_core.generate.protocol.MeshGenerator"),
        ("r2c2r.matchers", MATCHERS, "match_many", "r2c2r_core.align.protocol.Matcher"),
    ],
)
def test_a_plugin_backend_without_a_required_method_is_refused_by_name(
    install: Install, group: str, table: Registry, method: str, protocol: str
) -> None:
    install("delphi", group, "oracle = delphi:LINE", BACKEND.replace(f"def {method}(", "def forgotten("))
    with pytest.raises(BackendUnavailable) as caught:
        table.load("oracle")
    said = f"{table.seam} 'oracle' is not available: delphi:Oracle: it has no {method}"
    assert str(caught.value) == f"{said}; expected a class with the methods of {protocol}"


def test_a_plugin_backend_with_a_missing_or_abstract_class_is_refused(install: Install) -> None:
    unfinished = "\nfrom r2c2r_core.align.protocol import Matcher\n" + BACKEND.replace(
        "class Oracle:", "class Oracle(Matcher):"
    )
    install("delphi", "r2c2r.matchers", "oracle = delphi:LINE", unfinished.replace("def match(", "def forgotten("))
    with pytest.raises(BackendUnavailable, match="delphi:Oracle: it has no match;"):
        MATCHERS.load("oracle")
    install("dodona", "r2c2r.generators", "oracle = dodona:LINE", BACKEND.replace("class Oracle", "class Oak"))
    (Path(sys.modules["delphi"].__file__ or "")).write_text("")
    del sys.modules["delphi"]
    with pytest.raises(BackendUnavailable, match="delphi:Oracle: not found; "):
        GENERATORS.load("oracle")


def test_the_furniture_category_of_a_plugin_is_recognised_and_built(install: Install) -> None:
    assert named("wine larder").notice is not None
    install("larder", "r2c2r.fixtures", "larder = larder:LARDER", FIXTURE)
    for words in ("wine larder", "Wine Larders", "bodega"):
        category = category_of(words)
        assert category.name == "wine_larder"
    fixture = fixture_of(category)
    assert fixture is not None
    order = Order(dimensions_m=np.array([0.6, 0.58, 1.9]), material=category.material, hinge="left", handle=None)
    assert [part.name for part in fixture.build(order).parts] == ["base", "door"]


def test_the_output_format_of_a_plugin_is_written_and_linted(install: Install, tmp_path: Path) -> None:
    install("counting", "r2c2r.formats", "count = counting:COUNT", FORMAT)
    assert formats()[-1].name == "count"
    folder = write_folder(kitchen(), tmp_path / "bundle")
    assert int((folder / "scene.count").read_text()) > 3
    found = {finding.rule for finding in lint(folder)}
    (folder / "scene.count").write_text("many")
    assert {finding.where for finding in lint(folder) if finding.rule == "format"} == {"scene.count"}
    (folder / "scene.count").unlink()  # as made without that package: no finding
    assert {finding.rule for finding in lint(folder)} == found


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("READER = 'a reader'", "found a str, expected a Reader"),
        ("OTHER = 1", "AttributeError"),
    ],
)
def test_a_broken_plugin_is_reported_by_the_doctor_and_ignored(
    install: Install, tmp_path: Path, code: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    install("broken", "r2c2r.readers", "mine = broken:READER", code)
    (line,) = [line for line in doctors_lines(capsys).splitlines() if "plug-in mine" in line]
    assert "problem" in line
    assert "broken 1.2" in line
    assert said in line
    with pytest.raises(Exception, match="no known recording format"):
        open_recording(tmp_path)


def test_a_plugin_cannot_replace_a_built_in_backend(install: Install) -> None:
    code = BACKEND.replace('"oracle"', '"sift"')
    install("impostor", "r2c2r.matchers", "sift = impostor:LINE", code)
    assert MATCHERS.get("sift").target.startswith("r2c2r_core.")


def test_the_code_of_a_plugin_changes_only_the_key_of_its_stage(install: Install) -> None:
    before = {room: source_key(room) for room in ("ingest", "align", "warp")}
    file = install("sonar", "r2c2r.readers", "sonar = sonar:READER", READER)
    added = source_key("ingest")
    assert added != before["ingest"]
    assert {room: source_key(room) for room in ("align", "warp")} == {room: before[room] for room in ("align", "warp")}
    file.write_text(READER + "# louder\n")
    plugins.forget()
    assert source_key("ingest") not in (added, before["ingest"])


def test_a_plugin_format_that_fails_is_left_out_of_the_bundle(
    install: Install, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    install("counting", "r2c2r.formats", "count = counting:COUNT", FORMAT.replace("    Path(folder", "    1 / 0; Path(folder"))
    plan = supported(plan_bundle(kitchen()))
    write_meshes(plan, tmp_path)
    write_formats(plan, tmp_path, formats())
    written = {path.name for path in tmp_path.iterdir()}
    assert {entry.file for entry in FORMATS} <= written
    assert "scene.count" not in written
    assert "scene.count is left out of the bundle: ZeroDivisionError: division by zero" in caplog.text
