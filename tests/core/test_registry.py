import importlib
from pathlib import Path

import pytest

from r2c2r_core.align.protocol import MATCHERS, Matcher
from r2c2r_core.errors import BackendUnavailable, InputError
from r2c2r_core.generate.protocol import MeshGenerator
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.registry import Backend, Registry, Weights, find_weights
from r2c2r_core.segment.protocol import Segmenter
from r2c2r_core.segment.stage import SEGMENTERS

TABLE = Registry(
    "painter",
    (
        Backend(name="plain", target="pathlib:Path"),
        Backend(
            name="dreamer",
            target="types:SimpleNamespace",
            extra="dreams",
            needs=("json",),
            weights=Weights(usual="someone/dreams", variable="TEST_DREAMS_WEIGHTS"),
        ),
        Backend(name="absent", target="no_such_module:Class", extra="absent", needs=("no_such_module",)),
        Backend(
            name="gated",
            target="types:SimpleNamespace",
            weights=Weights(usual="someone/gated", variable="TEST_GATED_WEIGHTS", gated=True),
        ),
    ),
)


@pytest.fixture(autouse=True)
def empty_hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty hub cache for this test."""
    for name in ("TEST_DREAMS_WEIGHTS", "TEST_GATED_WEIGHTS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    return tmp_path / "hub"


def model_in(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "config.json").write_text("{}")
    (folder / "model.safetensors").write_bytes(b"")
    return folder


def test_a_missing_library_reports_the_extra_to_install() -> None:
    assert TABLE.available("absent") == (False, "missing no_such_module: pip install 'r2c2r[absent]'")
    with pytest.raises(BackendUnavailable, match=r"painter 'absent' is not available: missing no_such_module; pip install"):
        TABLE.load("absent")


def test_missing_weights_report_the_download_command() -> None:
    ready, reason = TABLE.available("dreamer")
    assert not ready
    assert reason == (
        "no weights at someone/dreams: hf download someone/dreams; or set TEST_DREAMS_WEIGHTS or "
        "segment.weights to a folder or hub id"
    )
    assert "accept the licence at https://huggingface.co/someone/gated" in TABLE.available("gated")[1]


def test_weights_are_found_by_setting_then_variable_then_hub_cache(
    tmp_path: Path, empty_hub: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cached = model_in(empty_hub / "models--someone--dreams" / "snapshots" / "abc")
    assert TABLE.load("dreamer").weights == cached
    named = model_in(tmp_path / "named")
    monkeypatch.setenv("TEST_DREAMS_WEIGHTS", str(named))
    assert TABLE.load("dreamer").weights == named
    set_here = model_in(tmp_path / "set")
    assert TABLE.load("dreamer", weights=str(set_here)).weights == set_here
    assert TABLE.weights_named("dreamer", str(set_here)) == str(set_here)
    assert TABLE.weights_named("plain", "anything") == ""


def test_the_main_snapshot_of_the_hub_cache_is_used(empty_hub: Path) -> None:
    repository = empty_hub / "models--someone--dreams"
    for commit in ("aaa", "bbb", "ccc"):
        model_in(repository / "snapshots" / commit)
    (repository / "refs").mkdir()
    (repository / "refs" / "main").write_text("bbb\n")
    found = find_weights("someone/dreams")
    assert found is not None
    assert found.name == "bbb"


def test_an_incomplete_download_is_not_a_model(tmp_path: Path, empty_hub: Path) -> None:
    folder = empty_hub / "models--someone--dreams" / "snapshots" / "abc"
    folder.mkdir(parents=True)
    (folder / "config.json").write_text("{}")
    assert find_weights("someone/dreams") is None
    assert find_weights(str(folder)) is None
    ready, reason = TABLE.available("dreamer", str(folder))
    assert not ready
    assert "expected a folder with config.json and *.safetensors" in reason


def test_unknown_names_list_the_choices() -> None:
    with pytest.raises(InputError, match="choose one of: plain, dreamer, absent, gated"):
        TABLE.get("other")


def test_learned_segmenters_state_their_licence_and_are_not_default() -> None:
    assert SEGMENTERS.default == "geometric"
    licences = {backend.name: (backend.licence, backend.licence_class) for backend in SEGMENTERS.backends}
    assert licences["sam2"][0].startswith("Apache-2.0")
    assert licences["edgetam"][0].startswith("Apache-2.0")
    assert licences["sam3"] == ("SAM License (gated weights; commercial use allowed, military use not)", "restricted")


@pytest.mark.parametrize(
    ("protocol", "backend"),
    [
        (protocol, backend)
        for protocol, table in ((Segmenter, SEGMENTERS), (MeshGenerator, GENERATORS), (Matcher, MATCHERS))
        for backend in table.backends
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_every_backend_subclasses_its_protocol(protocol: type, backend: Backend) -> None:
    module, name = backend.target.split(":")
    found = getattr(importlib.import_module(module), name)
    assert protocol in found.__mro__
    assert not found.__abstractmethods__
