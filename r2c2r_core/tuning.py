"""Tuned numbers: each module's in one frozen dataclass `Params` of its own, and a run may set others.

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Params:
        layer_m: float = param(0.003, "m", "half a layer's thickness", source="fused depth of a phone leaves a flat this even")

    def front(points): ... tuned(Params).layer_m ...

A module's numbers are known by its path in the core: `kitchen.fronts` are those of r2c2r_core/kitchen/fronts.py.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib import import_module
from pkgutil import walk_packages
from types import MappingProxyType
from typing import Any, TypeVar

CHOSEN = "chosen on the sample kitchens"
"""The source of a number that nobody measured and nobody derived."""

UNITS = frozenset(
    {"m", "m²", "m³", "m/s", "kg", "s", "rad", "deg", "px", "px²", "share", "ratio", "cosine", "log", "σ", "count"}
) | {
    *("bytes", "grey", "colour", "score"),
}
"""share: 0 to 1 of something named; ratio: of two of a kind; log: difference of natural logarithms; σ: standard deviations;
grey: levels of 255; colour: of a channel, 0 to 1; score: on a scale of its own."""

Number = float | int | tuple[float, ...]
Changes = Mapping[str, Mapping[str, Number]]
"""By module path: the numbers that a run sets, by name."""

P = TypeVar("P")

_active: ContextVar[Mapping[type, Any]] = ContextVar("tuned numbers", default=MappingProxyType({}))


def param(default: Any, unit: str, meaning: str, *, source: str = CHOSEN, **bounds: float) -> Any:
    """A field of a `Params`: a number (or a few in a tuple), what it is of, and where it was measured.

    `bounds` are gt, ge, lt, le; a share lies between 0 and 1 and a number that is not negative stays so without them.
    """
    usual: dict[str, float] = {"ge": 0} if not isinstance(default, tuple) and default >= 0 else {}
    if usual and unit == "share":
        usual["le"] = 1
    extra = {"unit": unit, "source": source}
    return dataclasses.field(
        default=default, metadata={"description": meaning, "json_schema_extra": extra, **(bounds or usual)}
    )


def tuned(of: type[P]) -> P:
    """The numbers of a module as they hold in this run: `tuned(Params)`."""
    given: P | None = _active.get().get(of)
    return _usual(of) if given is None else given  # type: ignore[arg-type]  # a class is hashable


@contextmanager
def tuning(numbers: Mapping[type, Any]) -> Iterator[None]:
    """By the class of each: the numbers that hold within, in this thread and in those that copy its context."""
    token = _active.set(numbers)
    try:
        yield
    finally:
        _active.reset(token)


def changed(changes: Changes) -> dict[type, Any]:
    """The `Params` that these changes make, for `tuning`; they were checked when they were read."""
    return {(of := params_of(path)): dataclasses.replace(of(), **values) for path, values in changes.items()}


def in_force(*rooms: str) -> dict[str, Any]:
    """By module path: the numbers of these packages that are set here, for other processes and for the key of what is kept."""
    found = {path_of(of): numbers for of, numbers in _active.get().items()}
    return {path: numbers for path, numbers in found.items() if path.partition(".")[0] in rooms}


def params_of(path: str) -> type[Any]:
    """The `Params` of a module."""
    of: type[Any] = import_module(f"{__package__}.{path}").Params
    return of


def path_of(of: type[Any]) -> str:
    """The path of the module whose numbers these are."""
    return of.__module__.removeprefix(f"{__package__}.")


@cache
def modules_with_numbers(room: str) -> tuple[str, ...]:
    """Paths of the modules of a package that have tuned numbers."""
    package = import_module(f"{__package__}.{room}")
    modules = [import_module(found.name) for found in walk_packages(package.__path__, f"{package.__name__}.")]
    found = {getattr(module, "Params", None) for module in modules}
    return tuple(sorted(path_of(of) for of in found if of is not None))


@cache
def _usual(of: Any) -> Any:
    return of()
