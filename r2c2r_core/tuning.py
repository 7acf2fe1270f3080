"""Tuned parameters: one frozen dataclass `Params` per module, which a run may change.

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Params:
        layer_m: float = param(0.003, "m", "half a layer's thickness", source="fused depth of a phone leaves a flat this even")

    def front(points): ... tuned(Params).layer_m ...

A module's parameters are addressed by its path in the core: `kitchen.fronts` are those of r2c2r_core/kitchen/fronts.py.
"""

import dataclasses
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib import import_module
from pkgutil import walk_packages
from types import MappingProxyType
from typing import Any, TypeVar

CHOSEN = "chosen on the sample kitchens"
"""The source of a number that was neither measured nor derived."""

UNITS = frozenset(
    {"m", "m²", "m³", "m/s", "kg", "s", "rad", "deg", "px", "px²", "share", "ratio", "cosine", "log", "σ", "count"}
    | {"bytes", "grey", "colour", "score"}
)
"""share: a fraction from 0 to 1; ratio: of two like quantities; log: difference of natural logarithms; σ: standard deviations;
grey: levels of 255; colour: of a channel, 0 to 1; score: on its own scale."""

Number = float | int | tuple[float, ...]
Changes = Mapping[str, Mapping[str, Number]]
"""Changed parameters of a run: by module path, then by name."""

P = TypeVar("P")

_active: ContextVar[Mapping[type, Any]] = ContextVar("tuned numbers", default=MappingProxyType({}))


def param(default: Any, unit: str, meaning: str, *, source: str = CHOSEN, **bounds: float) -> Any:
    """A field of a `Params`: a number (or a tuple of a few), its unit, its meaning, and its source.

    `bounds` are gt, ge, lt, le; by default a share lies between 0 and 1, and a non-negative number stays non-negative.
    """
    usual: dict[str, float] = {"ge": 0} if not isinstance(default, tuple) and default >= 0 else {}
    if usual and unit == "share":
        usual["le"] = 1
    extra = {"unit": unit, "source": source}
    return dataclasses.field(
        default=default, metadata={"description": meaning, "json_schema_extra": extra, **(bounds or usual)}
    )


def tuned(of: type[P]) -> P:
    """A module's parameters in this run: `tuned(Params)`."""
    given: P | None = _active.get().get(of)
    return _usual(of) if given is None else given  # type: ignore[arg-type]  # a class is hashable


@contextmanager
def tuning(numbers: Mapping[type, Any]) -> Iterator[None]:
    """Context with changed parameters, by class, valid in this thread and in those that copy its context."""
    token = _active.set(numbers)
    try:
        yield
    finally:
        _active.reset(token)


def changed(changes: Changes) -> dict[type, Any]:
    """Changed `Params` by class, for `tuning`; the changes were validated on reading."""
    return {(of := params_of(path)): dataclasses.replace(of(), **values) for path, values in changes.items()}


def in_force(modules: Collection[str]) -> dict[str, Any]:
    """Changed parameters of these modules by path, for other processes and for content keys."""
    return {path: numbers for of, numbers in _active.get().items() if (path := path_of(of)) in modules}


def params_of(path: str) -> type[Any]:
    """The `Params` of a module."""
    of: type[Any] = import_module(f"{__package__}.{path}").Params
    return of


def path_of(of: type[Any]) -> str:
    """Module path of a `Params` class."""
    return of.__module__.removeprefix(f"{__package__}.")


@cache
def modules_with_numbers(room: str) -> tuple[str, ...]:
    """Paths of the modules of a package that have tuned parameters."""
    package = import_module(f"{__package__}.{room}")
    modules = [import_module(found.name) for found in walk_packages(package.__path__, f"{package.__name__}.")]
    found = {getattr(module, "Params", None) for module in modules}
    return tuple(sorted(path_of(of) for of in found if of is not None))


@cache
def _usual(of: Any) -> Any:
    return of()
