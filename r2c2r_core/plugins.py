"""Plug-ins of other packages, by entry points: no edits here, and a broken plug-in does not stop a run.

| group              | what an entry point names                                                                |
|--------------------|------------------------------------------------------------------------------------------|
| `r2c2r.readers`    | a `Reader` (ingest/readers/protocol.py): a recording format                              |
| `r2c2r.segmenters` | a `Backend` (registry.py) whose target satisfies segment/protocol.py                     |
| `r2c2r.generators` | a `Backend` whose target satisfies generate/protocol.py                                  |
| `r2c2r.matchers`   | a `Backend` whose target satisfies align/protocol.py                                     |
| `r2c2r.fixtures`   | a `Category` (kitchen/category.py) whose fixture, "module:NAME", is a `Fixture`          |
| `r2c2r.formats`    | a `Format` (export/writers/table.py): a file of the bundle                               |
"""

import hashlib
import importlib.util
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Literal, TypeVar, get_args

Group = Literal["r2c2r.readers", "r2c2r.segmenters", "r2c2r.generators", "r2c2r.matchers", "r2c2r.fixtures", "r2c2r.formats"]
GROUPS: tuple[Group, ...] = get_args(Group)
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Plugin:
    """One entry point: its loaded value, or the reason why it cannot be used."""

    group: Group
    name: str
    package: str  # name and version of the distribution that brings it
    value: object | None
    fault: str = ""  # one line; empty where it loaded


def added(group: Group, kind: type[T]) -> tuple[T, ...]:
    """Valid entries of type `kind` that other packages add to a table; broken ones are left out (see `plugins`)."""
    return tuple(plugin.value for plugin in plugins(group, kind) if isinstance(plugin.value, kind))


def plugins(group: Group, kind: type) -> tuple[Plugin, ...]:
    """All entry points of a group in a deterministic order; one whose value is not a `kind` is marked as faulty."""
    return tuple(_of_kind(plugin, kind) for plugin in _loaded(group))


@cache
def plugin_key(group: Group) -> str:
    """Digest of the code of a group's entry points, so that a changed plug-in invalidates results; empty without any."""
    entries = _found(group)
    if not entries:
        return ""
    digest = hashlib.sha256()
    for entry in entries:
        digest.update(f"{entry.name}={entry.value} of {_package(entry)}\n".encode())
        for path in _sources(entry):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def forget() -> None:
    """Clear the cache of entry points, after packages were installed or removed while this process runs."""
    _loaded.cache_clear()
    plugin_key.cache_clear()


def _found(group: Group) -> list[EntryPoint]:
    return sorted(entry_points(group=group), key=lambda entry: (entry.name, entry.value))


@cache
def _loaded(group: Group) -> tuple[Plugin, ...]:
    return tuple(_load(group, entry) for entry in _found(group))


def _load(group: Group, entry: EntryPoint) -> Plugin:
    try:
        return Plugin(group, entry.name, _package(entry), entry.load())
    except Exception as error:  # foreign code may raise anything: it is reported, and the run continues without it
        fault = " ".join(f"{entry.value} does not load: {type(error).__name__}: {error}".split())
        return Plugin(group, entry.name, _package(entry), None, fault)


def _of_kind(plugin: Plugin, kind: type) -> Plugin:
    if plugin.fault or isinstance(plugin.value, kind):
        return plugin
    return replace(plugin, fault=f"found a {type(plugin.value).__name__}, expected a {kind.__name__}", value=None)


def _package(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist is not None else "an unknown package"


def _sources(entry: EntryPoint) -> Iterator[Path]:
    """The files of an entry point's top-level package or module, without importing it."""
    spec = importlib.util.find_spec(entry.module.partition(".")[0])
    if spec is None:
        return
    folders = [Path(place) for place in spec.submodule_search_locations or ()]
    if not folders and spec.origin is not None:
        yield Path(spec.origin)
    for folder in folders:
        yield from sorted(path for path in folder.rglob("*.py") if path.is_file())
