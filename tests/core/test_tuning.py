"""Tuned parameters: setting, visibility in workers, and recomputation."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from r2c2r_core.config import ReconstructConfig, config_from
from r2c2r_core.errors import InputError
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.kitchen.walls import Params
from r2c2r_core.ledger import Kept, Ledger, Shared
from r2c2r_core.pool import Pool
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.threads import in_threads
from r2c2r_core.tuning import UNITS, Changes, changed, modules_with_numbers, params_of, tuned, tuning
from r2c2r_core.workspace import Workspace

ROOMS = ("ingest", "segment", "generate", "align", "synthesize", "warp", "kitchen", "geometry")
WALLS: Changes = {"kitchen.walls": {"parallel_rad": 0.5}}


def noun_of_number(*_: Any, progress: Progress) -> PackedMask:
    """The current value of the parameter, in thousandths."""
    area = round(1000 * tuned(Params).parallel_rad)
    return PackedMask(height=1, width=1, left=0, top=0, box_width=0, box_height=0, bits=b"", area_px=area)


def opened(*_: Any, progress: Progress) -> float:
    return tuned(Params).parallel_rad


def areas(root: Path, numbers: Changes, workers: int = 1) -> tuple[list[int], list[str]]:
    """Results for two objects, and the steps computed for them."""
    work, items = Workspace(root), {"a": Kept(1, "a"), "b": Kept(2, "b")}
    with tuning(changed(numbers)), Pool(workers) as pool:
        ledger = Ledger(work, SILENT, "export", pool)
        found = ledger.each("segment", noun_of_number, items, items, Shared(opened, ()))
    return [kept.value.area_px for kept in found.values()], work.computed


@pytest.mark.parametrize("workers", [1, 2])
def test_a_tuned_parameter_applies_in_every_process(tmp_path: Path, workers: int) -> None:
    assert areas(tmp_path / "usual", {})[0] == [175, 175]
    assert areas(tmp_path / "set", WALLS, workers)[0] == [500, 500]
    assert tuned(Params) == Params()


def test_a_tuned_parameter_recomputes_only_dependent_stages(tmp_path: Path) -> None:
    assert areas(tmp_path, {})[1] == ["segment/a", "segment/b"]
    assert areas(tmp_path, {"warp.corners": {"rim_m": 0.007}})[1] == []
    assert areas(tmp_path, WALLS)[1] == ["segment/a", "segment/b"]
    assert areas(tmp_path, WALLS)[1] == []


def test_worker_threads_inherit_tuned_parameters_of_their_caller() -> None:
    with tuning({Params: Params(parallel_rad=0.5)}):
        assert list(in_threads(lambda _: tuned(Params).parallel_rad, range(4))) == [0.5] * 4
        other: list[float] = []
        thread = Thread(target=lambda: other.append(tuned(Params).parallel_rad))
        thread.start()
        thread.join()
    assert other == [Params().parallel_rad]


def test_concurrent_runs_keep_their_own_tuned_parameters() -> None:
    def seen(value: float) -> float:
        with tuning({Params: Params(parallel_rad=value)}):
            return tuned(Params).parallel_rad

    with ThreadPoolExecutor(4) as pool:
        values = [k / 100 for k in range(50)]
        assert list(pool.map(seen, values)) == values


def test_a_configuration_sets_parameters_by_stage_and_module() -> None:
    config = config_from({"kitchen": {"params": {"walls": {"parallel_rad": 0.5}}}}, "config.json")
    assert config.kitchen.params == {"walls": {"parallel_rad": 0.5}}
    assert config.numbers == WALLS
    assert ReconstructConfig().numbers == {}


@pytest.mark.parametrize(
    ("params", "says"),
    [
        ({"wals": {}}, "unknown key 'wals' in kitchen.params; expected category, depth, fillers, fronts"),
        ({"../walls": {}}, "unknown key '../walls' in kitchen.params"),
        ({"walls": {"parallel": 0.1}}, "kitchen.params.walls: unknown key 'parallel' in the document; expected parallel_rad"),
        ({"walls": {"parallel_rad": "wide"}}, "kitchen.params.walls: parallel_rad is 'wide'; expected Maximum angle"),
        ({"walls": {"parallel_rad": -0.1}}, "kitchen.params.walls: parallel_rad is -0.1"),
        ({"walls": {"parallel_rad": float("nan")}}, "kitchen.params.walls: parallel_rad is nan"),
        ({"fronts": {"least_points": 2.5}}, "kitchen.params.fronts: least_points is 2.5"),
        ({"fronts": {"agree_rad": [0.1]}}, "kitchen.params.fronts: agree_rad"),
        ({"walls": 3}, "kitchen.params.walls: the document is 3"),
        ([], "kitchen.params is []"),
    ],
)
def test_an_invalid_parameter_raises_a_one_line_error(params: Any, says: str) -> None:
    with pytest.raises(InputError) as caught:
        config_from({"kitchen": {"params": params}}, "config.json")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("room", ROOMS)
def test_every_parameter_documents_unit_meaning_and_source(room: str) -> None:
    for path in modules_with_numbers(room):
        assert params_of(path).__doc__, path
        for field in fields(params_of(path)):
            extra = field.metadata["json_schema_extra"]
            assert extra["unit"] in UNITS, f"{path}.{field.name}: {extra['unit']}"
            assert extra["source"], f"{path}.{field.name}"
            assert field.metadata["description"], f"{path}.{field.name}"


@pytest.mark.parametrize("room", ROOMS)
def test_default_parameters_are_within_their_bounds(room: str) -> None:
    usual = {
        path.partition(".")[2]: {f.name: f.default for f in fields(params_of(path))} for path in modules_with_numbers(room)
    }
    written = {module: {k: list(v) if isinstance(v, tuple) else v for k, v in of.items()} for module, of in usual.items()}
    read = getattr(config_from({room: {"params": written}}, "config.json"), room).params
    assert read == usual
